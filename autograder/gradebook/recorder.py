"""Records results in nbgrader's gradebook and writes feedback, one student after another.

nbgrader is slow, so `Recording` does it in a thread of its own while the rest of the class is running.
"""

from __future__ import annotations

import queue
import re
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from autograder.core.errors import GRADEBOOK_REFUSED, KitError
from autograder.core.files import write_beside
from autograder.course.lab import Lab
from autograder.course.paths import CoursePaths
from autograder.gradebook import own_tables
from autograder.gradebook.api import answered, last_error, open_api
from autograder.gradebook.database import make_folder
from autograder.gradebook.grades import ask
from autograder.gradebook.queries import digests
from autograder.gradebook.release import register
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
            make_folder(self._root)
            self._known = self._recorded(), self._shown()
        recorded, shown = self._known
        there = self._paths.autograded_notebook(student, self._lab.name).is_file()
        if self._force or not there or recorded.get(student) != own_tables.recordable(self._root, self._lab, student):
            return ["autograde", "generate_feedback"]
        page = self._paths.feedback_page(student, self._lab.name)
        mark = page.with_name(MARK)
        fresh = page.is_file() and mark.is_file() and mark.read_text(encoding="utf-8") == shown.get(student)
        # Who hands in once more through the exchange, and the same, fetches feedback by another secret.
        wanted = _secret_in(self._paths.submitted_notebook(student, self._lab.name).parent)
        return [] if fresh and wanted in ("", _secret_in(page.parent)) else ["generate_feedback"]

    def _recorded(self) -> dict[str, str]:
        return ask(self._root, lambda connection: own_tables.recorded(connection, self._lab.name), {})

    def _shown(self, student: str = "") -> dict[str, str]:
        return ask(self._root, lambda connection: digests(connection, self._lab.name, student), {})


def _secret_in(folder: Path) -> str:
    try:
        return exchange_secret.secret((folder / exchange_secret.FILE_NAME).read_bytes()[: exchange_secret.MOST_BYTES])
    except OSError:
        return ""


class Recording:
    """Records students in the order in which they are given.

    Args:
        recorder: that does it.
        on_recorded: called in this thread after each student.
    """

    def __init__(self, recorder: Recorder, on_recorded: Callable[[str], None]) -> None:
        """Begin to wait for students."""
        self._recorder, self._on_recorded = recorder, on_recorded
        self._students: queue.SimpleQueue[str | None] = queue.SimpleQueue()
        self._given_up = threading.Event()
        self._error: BaseException | None = None
        self._thread = threading.Thread(target=self._work, name="recording", daemon=True)
        self._thread.start()
        self.seconds = 0.0
        """How long it worked."""

    def put(self, student: str) -> None:
        """Have a student recorded.

        Raises:
            KitError: nothing can be recorded at all, which an earlier student has shown.
        """
        if self._error is not None:
            raise self._error
        self._students.put(student)

    def finish(self) -> None:
        """Wait until everyone is recorded.

        Raises:
            KitError: nothing can be recorded at all.
        """
        self._students.put(None)
        self._thread.join()
        if self._error is not None:
            raise self._error

    def give_up(self) -> None:
        """Wait until the student is recorded who is being recorded, and leave out the others."""
        self._given_up.set()
        self._students.put(None)
        self._thread.join()

    def _work(self) -> None:
        try:
            while (student := self._students.get()) is not None and not self._given_up.is_set():
                began = time.monotonic()
                self._recorder.record(student)
                self.seconds += time.monotonic() - began
                self._on_recorded(student)
        except BaseException as error:  # it is raised again where somebody waits
            self._error = error
