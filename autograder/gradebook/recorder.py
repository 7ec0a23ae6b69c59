"""Records results in nbgrader's gradebook and writes feedback, one student after another."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

from autograder.core.errors import GRADEBOOK_REFUSED, KitError
from autograder.core.files import write_beside
from autograder.course.lab import Lab
from autograder.course.paths import CoursePaths
from autograder.gradebook import notes
from autograder.gradebook.api import answered, last_error, open_api
from autograder.gradebook.keeping import make_room
from autograder.gradebook.reading import digests
from autograder.gradebook.release import register
from autograder.gradebook.scores import ask
from autograder.gradebook.settings import gradebook_place
from autograder.submission import exchange_secret

MARK = ".grades"
"""The file beside a feedback page that says which grades it shows."""
_NO_ROOM = re.compile(
    r"(No space left on device|database or disk is full|database is locked|disk I/O error|Disk quota exceeded"
    r"|readonly database|file is not a database|disk image is malformed|Read-only file system"
    r"|unable to open database file)"
)
"""What the machine says, through nbgrader, that will not be otherwise for the next student."""


class Recorder:
    """Records results in the gradebook and writes feedback, one student at a time, for those that changed."""

    def __init__(self, root: Path, lab: Lab, force: bool) -> None:
        """Nothing is loaded or written before something is to be recorded.

        Args:
            root: of the course.
            lab: whose results are recorded.
            force: record also what did not change.
        """
        self._root, self._lab, self._force = root, lab, force
        self._paths = CoursePaths(root)
        self._api: Any = None
        self._known: tuple[dict[str, str], dict[str, str]] | None = None
        self.failures: dict[str, str] = {}
        """Why it failed, by student; the others are recorded."""
        self.told: list[str] = []
        """What was changed about the gradebook itself, as sentences."""

    def begin(self) -> None:
        """Have a gradebook that can be written, with the lab's cells in it, before anything is run for it.

        Raises:
            KitError: there can be none.
        """
        self.told += register(self._root, self._lab.name)

    def record(self, student: str) -> None:
        """Record one student's result.

        Raises:
            KitError: nothing can be recorded at all.
            KeyboardInterrupt: the student counts as not recorded.
        """
        page = self._paths.feedback_page(student, self._lab.name)
        steps = self._due(student)
        if not steps:
            return
        if self._api is None:
            self._api = open_api(self._root)
        page.unlink(missing_ok=True)
        for step in steps:
            answer = answered(getattr(self._api, step)(self._lab.name, student, force=True))
            if not answer["success"]:
                self._failed(student, answer)
                return
        write_beside(page.with_name(MARK), self._shown(student).get(student, ""))

    def _failed(self, student: str, answer: dict[str, Any]) -> None:
        why = last_error(answer)
        refused = _NO_ROOM.search(why)
        if refused:
            raise KitError(
                f"Recording {student} failed, since the machine said: {refused[0]}. The gradebook is"
                f" {gradebook_place(self._root)}.",
                GRADEBOOK_REFUSED,
            )
        self.failures[student] = why

    def _due(self, student: str) -> list[str]:
        """The steps of nbgrader's that a student needs; none if neither the result nor a grade changed.

        The gradebook itself says what was recorded in it, so that one that was put back gets what it lacks.
        """
        if self._known is None:
            make_room(self._root)
            self._known = self._recorded(), self._shown()
        recorded, shown = self._known
        there = self._paths.autograded_notebook(student, self._lab.name).is_file()
        if self._force or not there or recorded.get(student) != notes.recordable(self._root, self._lab, student):
            return ["autograde", "generate_feedback"]
        page = self._paths.feedback_page(student, self._lab.name)
        mark = page.with_name(MARK)
        fresh = page.is_file() and mark.is_file() and mark.read_text(encoding="utf-8") == shown.get(student)
        # Who hands in once more through the exchange, and the same, fetches feedback by another secret.
        wanted = _secret_in(self._paths.submitted_notebook(student, self._lab.name).parent)
        return [] if fresh and wanted in ("", _secret_in(page.parent)) else ["generate_feedback"]

    def _recorded(self) -> dict[str, str]:
        return ask(self._root, lambda connection: notes.recorded(connection, self._lab.name), {})

    def _shown(self, student: str = "") -> dict[str, str]:
        return ask(self._root, lambda connection: digests(connection, self._lab.name, student), {})


def _secret_in(folder: Path) -> str:
    try:
        return exchange_secret.secret((folder / exchange_secret.FILE_NAME).read_bytes()[: exchange_secret.MOST_BYTES])
    except OSError:
        return ""
