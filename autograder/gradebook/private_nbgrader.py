"""Everything that the kit uses of nbgrader and that nbgrader has not promised to keep, in one place.

`tests/test_private_names.py` says which of these an update has moved; pyproject.toml keeps untested ones away.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from nbgrader import utils
from nbgrader.converters import Autograde
from nbgrader.converters.generate_solution import GenerateSolution
from nbgrader.preprocessors import Execute, SaveAutoGrades
from nbgrader.validator import Validator

Verdicts = dict[str, list[dict[str, str]]]
"""What did not pass, or what did, in the form that nbgrader's validator shows."""


def in_first_pass(autograde: Autograde) -> bool:
    """Whether `nbgrader autograde` reads what was handed in; in its second pass it reads what the first one wrote."""
    return bool(autograde._sanitizing)


class SaveScores(SaveAutoGrades):  # type: ignore[misc]
    """nbgrader's stage that records points, without its way of finding the points of a check cell."""

    def score_check(self, grade: Any, resources: dict[str, Any]) -> None:
        """Set the points of a check cell in its grade."""
        raise NotImplementedError

    def _add_score(self, cell: Any, resources: dict[str, Any]) -> None:
        if utils.is_solution(cell) or cell.cell_type != "code":
            super()._add_score(cell, resources)
            return
        grade_id = cell.metadata["nbgrader"]["grade_id"]
        self.score_check(
            self.gradebook.find_grade(grade_id, self.notebook_id, self.assignment_id, self.student_id), resources
        )
        self.gradebook.db.commit()


def replace_execution(validate: Callable[[Path, bool], Verdicts], refuse: Callable[[], Exception]) -> None:
    """Put other ways in place of nbgrader's validator and of its stage that executes, for this process.

    nbgrader has no setting for either. Solutions, which are the instructor's own, may still be executed.

    Args:
        validate: gets a notebook, and whether what passed is asked for.
        refuse: makes the error that ends every other execution.
    """
    execute = Execute.preprocess

    def validated(self: Any, filename: str) -> Verdicts:
        return validate(Path(filename), self.invert)

    def preprocess(self: Any, nb: Any, resources: Any = None, km: Any = None) -> Any:
        if isinstance(self.parent, GenerateSolution):
            return execute(self, nb, resources, km)
        raise refuse()

    Validator.validate = validated
    if execute.__qualname__ != preprocess.__qualname__:  # else it is replaced already
        Execute.preprocess = preprocess
