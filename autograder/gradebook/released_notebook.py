"""The course's own stages of `nbgrader generate_assignment`: the notebook that students receive."""

from __future__ import annotations

import re
from typing import Any

import nbformat
from nbgrader import utils
from nbgrader.preprocessors import (
    CheckCellMetadata,
    ClearMarkScheme,
    ClearOutput,
    ClearSolutions,
    ComputeChecksums,
    LockCells,
    NbGraderPreprocessor,
)

from autograder.course.cells import blank_mark, without_hidden_tests
from autograder.gradebook.migration import FitCells
from autograder.submission.copies import named_file


class HideTests(NbGraderPreprocessor):  # type: ignore[misc]
    """Keeps hidden tests out of what students receive, and says where they were."""

    def preprocess_cell(self, cell: Any, resources: dict[str, Any], index: int) -> tuple[Any, dict[str, Any]]:
        """Cut in the lab's own cells; a student who types a marker only types a word."""
        if not utils.is_solution(cell):
            cell.source = without_hidden_tests(cell.source)
        return cell, resources


class StableNotebook(NbGraderPreprocessor):  # type: ignore[misc]
    """Leaves in a released notebook only what the lab's source decides, so that generating twice gives equal files."""

    def preprocess(self, nb: Any, resources: dict[str, Any]) -> tuple[Any, dict[str, Any]]:
        """Name the cells by grade_id or number and drop what editors leave behind."""
        ids: set[str] = set()
        answers: dict[str, str] = {}
        for number, cell in enumerate(nb.cells, start=1):
            grade_id = cell.metadata.get("nbgrader", {}).get("grade_id", "")
            name = re.sub(r"[^A-Za-z0-9_-]", "-", grade_id)[:60] or f"text-{number:02d}"
            cell["id"] = name if name not in ids else f"{name[:50]}-{number:02d}"
            ids.add(cell["id"])
            for key in ("collapsed", "scrolled", "ExecuteTime", "execution", "jupyter"):
                cell.metadata.pop(key, None)
            if cell.cell_type == "code":
                cell.outputs, cell.execution_count = [], None
                if utils.is_solution(cell):
                    cell.metadata["autograder"] = blank_mark(cell.source)
                    file = named_file(cell)
                    if file is not None:  # whoever deletes the cell is told so in the notebook
                        answers[grade_id] = file.file_name
        kernel = {"display_name": "Python 3 (ipykernel)", "language": "python", "name": "python3"}
        mark = {"autograder": {"answers": answers}} if answers else {}
        nb.metadata = nbformat.from_dict({"kernelspec": kernel, "language_info": {"name": "python"}} | mark)
        nb.nbformat, nb.nbformat_minor = 4, 5
        return nb, resources


RELEASE = [
    LockCells,
    ClearSolutions,
    ClearOutput,
    CheckCellMetadata,
    ComputeChecksums,
    FitCells,
    HideTests,
    ClearMarkScheme,
    ComputeChecksums,
    CheckCellMetadata,
    StableNotebook,
]


WITHOUT_GRADEBOOK = [stage for stage in RELEASE if stage is not FitCells]
"""Where labs are generated without a gradebook: making one takes longer than all the rest."""
