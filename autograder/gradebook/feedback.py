"""The course's own stage of `nbgrader generate_feedback`, which makes the feedback page for a student.

The page is made from the stored result, the gradebook and the text of the answers. It contains no HTML from a notebook.
"""

from __future__ import annotations

import contextlib
import datetime
from pathlib import Path
from typing import Any

from nbconvert.exporters import Exporter
from nbgrader import utils
from nbgrader.converters import GenerateFeedback

from autograder.core.errors import KitError
from autograder.core.history import Entry, decisions
from autograder.core.history import told as told_history
from autograder.core.results import SubmissionResult
from autograder.course.cells import headings
from autograder.course.lab import Lab, load_lab
from autograder.course.settings import read_settings
from autograder.gradebook import own_tables
from autograder.gradebook.exchange_files import complete, only_notebooks
from autograder.gradebook.history import note_graded
from autograder.gradebook.queries import engine_of, read_grade
from autograder.grading.store import ResultStore
from autograder.intake.roster import FILE_NAME, read_roster
from autograder.report.feedback_page import Heading, Task, feedback_html
from autograder.report.words import plain_title
from autograder.submission import timestamp

_PART = 2
"""The level of the headings of a lab's parts."""


class FeedbackExporter(Exporter):  # type: ignore[misc]
    """Makes the page of one submission."""

    def __init__(self, *args: Any, **kwargs: Any) -> None:
        """Set the file ending to `.html`, and keep nbgrader from copying anything but notebooks."""
        super().__init__(*args, **kwargs)
        self.file_extension = ".html"
        if isinstance(self.parent, GenerateFeedback):
            self.parent.coursedir = only_notebooks(self.parent.coursedir)

    def from_notebook_node(
        self, nb: Any, resources: dict[str, Any] | None = None, **kwargs: Any
    ) -> tuple[str, dict[str, Any]]:
        """Return the page for `nb`, which is nbgrader's copy of the submission."""
        copied, resources = super().from_notebook_node(nb, resources, **kwargs)
        course, told = self.parent.coursedir, resources["nbgrader"]
        student, name = told["student"], told["assignment"]
        root = Path(course.root)
        folder = Path(course.format_path(course.submitted_directory, student, name))
        lab = load_lab(root, name)
        complete(folder, Path(course.format_path(course.feedback_directory, student, name)))
        entries = _history(told["db_url"], lab, student, folder / f"{name}.ipynb")
        page = feedback_html(
            Heading(_title(lab), student, _name(root, student), _handed_in(folder)),
            _tasks(copied),
            _result(told["db_url"], root, lab, student),
            read_grade(told["db_url"], name, student),
            datetime.date.today(),
            decisions(entries),
            told_history(entries) if read_settings(root).history_for_students else [],
        )
        return page, resources


def _history(address: str, lab: Lab, student: str, notebook: Path) -> list[Entry]:
    """Note what is new in the history of a submission, and return the whole history."""
    engine = engine_of(address)
    try:
        with engine.begin() as connection:
            own_tables.make_tables(connection)
            note_graded(connection, lab, student, notebook)
            return own_tables.history(connection, lab.name, student)[student]
    finally:
        engine.dispose()


def _title(lab: Lab) -> str:
    texts = ("".join(cell.get("source", "")) for cell in lab.released if cell["cell_type"] == "markdown")
    titles = (text for markdown in texts for _, text in headings(markdown))
    return plain_title(next(titles, lab.name))


def _name(root: Path, student: str) -> str:
    """Return a student's name from the roster; empty if there is none or the roster cannot be read.

    An unreadable roster is reported when the class is graded.
    """
    with contextlib.suppress(KitError):
        return read_roster(root / FILE_NAME).students.get(student, {}).get("name", "")
    return ""


def _handed_in(folder: Path) -> str:
    with contextlib.suppress(OSError):
        return timestamp.moment((folder / timestamp.FILE_NAME).read_bytes()[: timestamp.MOST_BYTES]) or ""
    return ""


def _result(address: str, root: Path, lab: Lab, student: str) -> SubmissionResult | None:
    """Return the result that the gradebook has recorded, even if an earlier version of the kit made it.

    None: it is not there any more, or the lab has changed since.
    """
    engine = engine_of(address)
    try:
        with engine.connect() as connection:
            recorded = own_tables.recorded(connection, lab.name, student).get(student)
    finally:
        engine.dispose()
    if recorded != own_tables.recordable(root, lab.name, lab.source_digest, student):
        return None
    return ResultStore(root).readable(lab, student)


def _tasks(nb: Any) -> list[Task]:
    """Return a task for each heading that is followed by cells with points.

    Answers without points belong to the next task with points.
    """
    tasks: list[Task] = []
    title, part, answers = "", "", {}
    for cell in nb.cells:
        if cell.cell_type == "markdown" and not utils.is_solution(cell):
            for level, text in headings(cell.source):
                title = plain_title(text)
                part = title if level <= _PART else part
        if utils.is_solution(cell):
            answers[cell.metadata.nbgrader["grade_id"]] = cell.source
        if utils.is_grade(cell):
            if not tasks or tasks[-1].title != title:
                tasks.append(Task(title, part=part))
            tasks[-1].graded.append(cell.metadata.nbgrader["grade_id"])
            tasks[-1].answers |= answers
            answers = {}
    return tasks
