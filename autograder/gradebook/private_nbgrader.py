"""What the kit uses of nbgrader that nbgrader has not promised to keep; `grading/nbgrader_validate.py` has the rest.

`tests/gradebook/test_private_names.py` says which of these an update has moved; pyproject.toml keeps untested ones
away.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable
from pathlib import Path
from typing import Any

from alembic.script import ScriptDirectory
from nbgrader import api, utils
from nbgrader.api import MissingEntry
from nbgrader.converters import Autograde
from nbgrader.converters.generate_solution import GenerateSolution
from nbgrader.dbutil import ALEMBIC_DIR
from nbgrader.preprocessors import Execute, SaveAutoGrades, SaveCells

from autograder.grading.nbgrader_validate import Verdicts, replace_validator


def in_first_pass(autograde: Autograde) -> bool:
    """Whether `nbgrader autograde` reads what was handed in; in its second pass it reads what the first one wrote."""
    return bool(autograde._sanitizing)


class SaveScores(SaveAutoGrades):  # type: ignore[misc]
    """nbgrader's stage that records points, without its ways of finding them and of asking for a person."""

    @abstractmethod
    def score_check(self, grade: Any, resources: dict[str, Any]) -> None:
        """Set the points of a check cell in its grade."""

    @abstractmethod
    def needs_person(self, grade: Any, cell: Any, asked: bool) -> bool:
        """Whether a person has to look at a cell, whose grade has its points; `asked`: whether one had to before."""

    def _add_score(self, cell: Any, resources: dict[str, Any]) -> None:
        grade_id = cell.metadata["nbgrader"]["grade_id"]
        grade = self.gradebook.find_grade(grade_id, self.notebook_id, self.assignment_id, self.student_id)
        asked = bool(grade.needs_manual_grade)
        if utils.is_solution(cell) or cell.cell_type != "code":
            super()._add_score(cell, resources)
        else:
            self.score_check(grade, resources)
        grade.needs_manual_grade = self.needs_person(grade, cell, asked)
        self.gradebook.db.commit()


class SaveLabCells(SaveCells):  # type: ignore[misc]
    """nbgrader's stage that notes a lab's cells, which by itself refuses a lab that has grades and other cells now."""

    @abstractmethod
    def fit(self, notebook: Any, new: dict[str, dict[str, Any]]) -> None:
        """Give the notebook in the gradebook, which has grades, the cells that the lab has now.

        Args:
            notebook: as the gradebook has it.
            new: what nbgrader notes of each cell, by kind (`grade`, `solution`, `task`, `source`) and name.
        """

    def _create_notebook(self, nb: Any) -> None:
        kinds = ("grade", "solution", "task", "source")
        new = {kind: getattr(self, f"new_{kind}_cells") for kind in kinds}
        try:
            notebook = self.gradebook.find_notebook(self.notebook_id, self.assignment_id)
        except MissingEntry:
            notebook = None
        if notebook is not None and notebook.submissions:
            self.fit(notebook, new)
        super()._create_notebook(nb)


def version_of_tables() -> str:
    """The version of the gradebook's tables that nbgrader makes; it asks a program of alembic's, which takes a second.

    Raises:
        RuntimeError: nbgrader's folder of versions has more than one newest one.
    """
    newest = ScriptDirectory(ALEMBIC_DIR).get_heads()
    if len(newest) != 1:
        raise RuntimeError(f"nbgrader's versions of tables end in {newest}")
    return str(newest[0])


def know_version_of_tables() -> None:
    """Let nbgrader find the version of the tables in this process when it makes a gradebook."""
    api.get_alembic_version = version_of_tables


def replace_execution(validate: Callable[[Path, bool], Verdicts], refuse: Callable[[], Exception]) -> None:
    """Put other ways in place of nbgrader's validator and of its stage that executes, for this process.

    nbgrader has no setting for either. Solutions, which are the instructor's own, may still be executed.

    Args:
        validate: gets a notebook, and whether what passed is asked for.
        refuse: makes the error that ends every other execution.
    """
    execute = Execute.preprocess

    def preprocess(self: Any, nb: Any, resources: Any = None, km: Any = None) -> Any:
        if isinstance(self.parent, GenerateSolution):
            return execute(self, nb, resources, km)
        raise refuse()

    replace_validator(validate)
    if execute.__qualname__ != preprocess.__qualname__:  # else it is replaced already
        Execute.preprocess = preprocess
