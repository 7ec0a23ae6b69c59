"""Configure nbgrader with the course's layout and stages, and with the table that `nbgrader export` writes."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from nbgrader.plugins import CsvExportPlugin

from autograder.course.cells import CODE_STUB, TEXT_STUB
from autograder.course.paths import CoursePaths
from autograder.gradebook.autograde import AUTOGRADE, SANITIZE, SubmissionExporter
from autograder.gradebook.exchange_files import CollectNotebooks
from autograder.gradebook.feedback import FeedbackExporter
from autograder.gradebook.history import watch_people
from autograder.gradebook.released_notebook import RELEASE, WITHOUT_GRADEBOOK
from autograder.grading.nbgrader_validate import HEADING
from autograder.intake.record import left_class


class ExportOfClass(CsvExportPlugin):  # type: ignore[misc]
    """Writes a row for every student of each assignment, except for students who have left its class.

    nbgrader itself writes all students in the gradebook, which also keeps the grades of students who have left.
    """

    def export(self, gradebook: Any) -> None:
        """Write the table."""
        super().export(_Classes(gradebook, Path(self.parent.coursedir.root)))


class _Classes:
    """A gradebook that is read assignment by assignment, with only the students of the current assignment's class."""

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


NOT_RELEASED = [".ipynb_checkpoints", "*.pyc", "__pycache__", ".*", "nodes"]
"""The names of files that are not part of a lab or a submission, although they are in the same folder."""


def configure(config: Any, root: Path) -> None:
    """Write the course's layout and stages into an nbgrader configuration.

    Args:
        config: the Config of traitlets that `get_config()` returns.
        root: the course's folder.
    """
    watch_people()
    paths = CoursePaths(root)
    course = config.CourseDirectory
    course.root = str(root)
    course.source_directory = str(paths.solutions.relative_to(root))
    course.release_directory = str(paths.labs.relative_to(root))
    course.submitted_directory = str(paths.submitted.relative_to(root))
    course.autograded_directory = str(paths.autograded.relative_to(root))
    course.feedback_directory = str(paths.feedback.relative_to(root))
    course.db_url = paths.gradebook_url
    course.ignore = NOT_RELEASED
    config.ExchangeFactory.collect = CollectNotebooks
    config.ExportApp.plugin_class = ExportOfClass
    config.Autograde.exporter_class = SubmissionExporter
    config.SubmissionExporter.optimistic_validation = True  # validate a notebook after the last stage, not after each
    config.Autograde.sanitize_preprocessors = SANITIZE
    config.Autograde.autograde_preprocessors = AUTOGRADE
    config.GenerateFeedback.exporter_class = FeedbackExporter
    config.GenerateFeedback.preprocessors = []
    config.GenerateAssignment.preprocessors = RELEASE
    config.Validator.failed_warning = HEADING
    config.ClearSolutions.code_stub = {"python": CODE_STUB}
    config.ClearSolutions.text_stub = TEXT_STUB


def leave_gradebook_alone(config: Any) -> None:
    """Configure nbgrader to generate labs without a gradebook."""
    config.GenerateAssignment.no_database = True
    config.GenerateAssignment.preprocessors = WITHOUT_GRADEBOOK
