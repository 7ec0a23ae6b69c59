"""nbgrader's own table of grades, `nbgrader export`, of who is in the class.

nbgrader takes every student of the gradebook, which also keeps the grades of those who have left.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from nbgrader.plugins import CsvExportPlugin

from autograder.intake.record import left_class


class ExportOfClass(CsvExportPlugin):  # type: ignore[misc]
    """Writes for each assignment a row for every student, except for who has left its class."""

    def export(self, gradebook: Any) -> None:
        """Write the table."""
        super().export(_Classes(gradebook, Path(self.parent.coursedir.root)))


class _Classes:
    """A gradebook that is read assignment by assignment, with the students of the one that is being read."""

    def __init__(self, gradebook: Any, root: Path) -> None:
        self._gradebook, self._root, self._left = gradebook, root, set[str]()

    @property
    def assignments(self) -> Iterator[Any]:
        for assignment in self._gradebook.assignments:
            self._left = left_class(self._root, assignment.name)
            yield assignment

    @property
    def students(self) -> list[Any]:
        return [student for student in self._gradebook.students if student.id not in self._left]

    def __getattr__(self, name: str) -> Any:
        return getattr(self._gradebook, name)
