"""The course's own stages of `nbgrader generate_assignment`: what students receive, and a lab's cells in the gradebook.

nbgrader refuses to change the cells of a lab that has grades. The stages here change them to the lab's current cells. A
cell that was only renamed is recognised by its text and keeps its grades. Before a change, the gradebook is copied, so
that the copy still holds what is no longer in the lab.
"""

from __future__ import annotations

import difflib
import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

import nbformat
from nbgrader import utils
from nbgrader.api import Comment, Grade, Gradebook
from nbgrader.preprocessors import (
    CheckCellMetadata,
    ClearMarkScheme,
    ClearOutput,
    ClearSolutions,
    ComputeChecksums,
    LockCells,
    NbGraderPreprocessor,
)

from autograder.course.cells import blank_mark, for_checks, without_hidden_tests
from autograder.course.lab import load_lab
from autograder.course.versions import remember
from autograder.gradebook import own_tables
from autograder.gradebook.backup import back_up
from autograder.gradebook.private_nbgrader import SaveLabCells
from autograder.submission.copies import named_file

_ALIKE = 0.6
"""The share of two cells' texts that must be equal for one to count as the other after renaming."""


@dataclass(frozen=True)
class _Cell:
    """A cell of a lab with the properties that a gradebook stores."""

    kinds: frozenset[str]
    cell_type: str
    source: str


class FitCells(SaveLabCells):
    """Stores a lab's cells in the gradebook, even if the gradebook has grades for other cells."""

    told: ClassVar[list[str]] = []
    """Sentences about changes of gradebooks that have grades."""

    def preprocess(self, nb: Any, resources: dict[str, Any]) -> tuple[Any, dict[str, Any]]:
        """Store the cells, and a digest of the lab that they come from."""
        made: tuple[Any, dict[str, Any]] = super().preprocess(nb, resources)
        course = self.parent.parent.coursedir
        lab = load_lab(Path(course.root), resources["nbgrader"]["assignment"])
        remember(Path(course.root), lab.name, lab.released)
        with Gradebook(resources["nbgrader"]["db_url"]) as gradebook:
            own_tables.make_tables(gradebook.engine)
            own_tables.note_recorded(gradebook.db, lab.name, own_tables.THE_LAB, lab.source_digest)
            gradebook.db.commit()
        return made

    def fit(self, notebook: Any, new: dict[str, dict[str, Any]]) -> None:
        """Rename, remove and add cells in the gradebook."""
        before, after = _known(notebook), _wanted(new)
        renamed = _renamed(before, after)
        left = before.keys() - renamed.keys()
        gone = {name for name in left if name not in after or after[name].kinds != before[name].kinds}
        fresh = {name for name in after.keys() - set(renamed.values()) if name not in before or name in gone}
        if not (renamed or gone or fresh):
            return
        copy = back_up(self.db_url, f"before the cells of {self.assignment_id} change")
        sentences = [*self._rename(notebook, renamed), *self._remove(notebook, gone), *self._add(notebook, fresh, new)]
        where = f"; a copy of the gradebook before this change is {copy}" if copy else ""
        for sentence in sentences:
            self.log.warning(sentence)
        FitCells.told.append(f"{self.assignment_id} has other cells than the gradebook: {'; '.join(sentences)}{where}.")

    def _rename(self, notebook: Any, renamed: Mapping[str, str]) -> list[str]:
        for cell in (*_graded(notebook), *notebook.source_cells):
            cell.name = renamed.get(cell.name, cell.name)
        self.gradebook.db.commit()
        return [f"{old} is called {name} now and keeps its grades" for old, name in sorted(renamed.items())]

    def _remove(self, notebook: Any, gone: set[str]) -> list[str]:
        said: dict[str, str] = {}
        for cell in [cell for cell in _graded(notebook) if cell.name in gone]:
            by_hand = sum(grade.manual_score is not None for grade in cell.grades)
            if by_hand or cell.name not in said:
                also = f", with the points by hand of {by_hand} student{'s' * (by_hand > 1)}" if by_hand else ""
                said[cell.name] = f"{cell.name} is no longer graded{also}"
            for record in (*cell.grades, *cell.comments, cell):
                self.gradebook.db.delete(record)
        for cell in [cell for cell in notebook.source_cells if cell.name in gone]:
            self.gradebook.db.delete(cell)
        self.gradebook.db.commit()
        return [said[name] for name in sorted(said)]

    def _add(self, notebook: Any, fresh: set[str], new: dict[str, dict[str, Any]]) -> list[str]:
        make = {
            "grade": self.gradebook.update_or_create_grade_cell,
            "solution": self.gradebook.update_or_create_solution_cell,
            "task": self.gradebook.update_or_create_task_cell,
            "source": self.gradebook.update_or_create_source_cell,
        }
        graded = set()
        for kind, cells in new.items():
            for name in sorted(fresh & cells.keys()):
                cell = make[kind](name, self.notebook_id, self.assignment_id, **cells[name])
                for submission in notebook.submissions if kind != "source" else []:
                    if kind in ("grade", "task"):
                        graded.add(name)
                        self.gradebook.db.add(Grade(cell_id=cell.id, notebook=submission))
                    if kind in ("solution", "task"):
                        self.gradebook.db.add(Comment(cell_id=cell.id, notebook=submission))
        self.gradebook.db.commit()
        return [f"{name} is new" for name in sorted(graded)]


def _graded(notebook: Any) -> list[Any]:
    return [*notebook.grade_cells, *notebook.solution_cells, *notebook.task_cells]


def _known(notebook: Any) -> dict[str, _Cell]:
    """Return the cells that the gradebook has, by name."""
    kinds: dict[str, set[str]] = {cell.name: {"source"} for cell in notebook.source_cells}
    for kind in ("grade", "solution", "task"):
        for cell in getattr(notebook, f"{kind}_cells"):
            kinds.setdefault(cell.name, {"source"}).add(kind)
    cells = notebook.source_cells
    return {cell.name: _Cell(frozenset(kinds[cell.name]), cell.cell_type, cell.source or "") for cell in cells}


def _wanted(new: dict[str, dict[str, Any]]) -> dict[str, _Cell]:
    """Return the cells that the lab has now, by name."""
    made = {}
    for name, info in new["source"].items():
        kinds = frozenset(kind for kind, cells in new.items() if name in cells)
        made[name] = _Cell(kinds, info["cell_type"], info["source"])
    return made


def _renamed(before: Mapping[str, _Cell], after: Mapping[str, _Cell]) -> dict[str, str]:
    """Return the new names of renamed cells by their old names. The most similar cells are matched first."""
    pairs = []
    for name, old in before.items():
        for other, new in after.items():
            if name not in after and other not in before and (new.kinds, new.cell_type) == (old.kinds, old.cell_type):
                likeness = difflib.SequenceMatcher(None, old.source, new.source, autojunk=False).ratio()
                pairs.append((-likeness, name, other))
    renamed: dict[str, str] = {}
    for unlikeness, name, other in sorted(pairs):
        if -unlikeness >= _ALIKE and name not in renamed and other not in renamed.values():
            renamed[name] = other
    return renamed


class HideTests(NbGraderPreprocessor):  # type: ignore[misc]
    """Removes hidden tests from what students receive, and leaves a line where they were."""

    def preprocess_cell(self, cell: Any, resources: dict[str, Any], index: int) -> tuple[Any, dict[str, Any]]:
        """Remove hidden tests from the lab's own cells. In an answer cell a marker has no meaning."""
        if not utils.is_solution(cell):
            cell.source = without_hidden_tests(cell.source)
        return cell, resources


class StableNotebook(NbGraderPreprocessor):  # type: ignore[misc]
    """Keeps only what the lab's source determines, so that generating a notebook twice gives equal files."""

    def preprocess(self, nb: Any, resources: dict[str, Any]) -> tuple[Any, dict[str, Any]]:
        """Name the cells by grade_id or number, and remove metadata that editors add."""
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
                if (utils.is_grade(cell) and not utils.is_solution(cell)) or for_checks(cell):
                    # Students only run this cell. Those who want to read it can expand it.
                    cell.metadata["jupyter"] = {"source_hidden": True}
                if utils.is_solution(cell):
                    cell.metadata["autograder"] = blank_mark(cell.source)
                    file = named_file(cell)
                    if file is not None:  # with this, the notebook can warn a student who deletes the cell
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
"""The stages for labs that are generated without a gradebook; creating one takes longer than all other stages."""
