"""Record results in nbgrader's gradebook and write feedback, one student after another.

Because nbgrader is slow, `Recording` does this in its own thread while the rest of the class is running.
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
from autograder.gradebook.pages import MARK, shows
from autograder.gradebook.queries import digests
from autograder.gradebook.release import register
from autograder.gradebook.settings import gradebook_place
from autograder.submission import exchange_secret

_NO_ROOM = re.compile(
    r"(No space left on device|database or disk is full|database is locked|disk I/O error|Disk quota exceeded"
    r"|readonly database|file is not a database|disk image is malformed|Read-only file system"
    r"|unable to open database file)"
)
"""Errors of the system in nbgrader's log that would occur for every other student as well."""


class Recorder:
    """Records results in the gradebook and writes feedback, one student at a time, if something has changed."""

    def __init__(self, root: Path, lab: Lab, force: bool) -> None:
        """Store the arguments. Nothing is loaded or written before the first method is called.

        Args:
            root: the course's folder.
            lab: the lab whose results are recorded.
            force: whether to record also results that have not changed.
        """
        self._root, self._lab, self._force = root, lab, force
        self._paths = CoursePaths(root)
        self._api: Any = None
        self._known: tuple[dict[str, str], dict[str, str]] | None = None
        self.failures: dict[str, str] = {}
        """The reason why a student could not be recorded, by student. All others are recorded."""
        self.told: list[str] = []
        """Sentences about changes of the gradebook itself."""

    def begin(self) -> None:
        """Make sure that the gradebook can be written and has the lab's cells, before any submission is run.

        Raises:
            KitError: the gradebook cannot be used.
        """
        self.told += register(self._root, self._lab.name)

    def record(self, student: str) -> None:
        """Record one student's result.

        Raises:
            KitError: nothing can be recorded, for this or any other student.
            KeyboardInterrupt: recording was interrupted. The student counts as not recorded.
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

    def lacks_only_a_page(self, student: str) -> bool:
        """Return whether a student's grade is recorded, but the feedback page does not show it."""
        return self._due(student) == ["generate_feedback"]

    def _failed(self, student: str, answer: dict[str, Any]) -> None:
        why = last_error(answer)
        refused = _NO_ROOM.search(why)
        if refused:
            raise KitError(
                f"Recording {student} failed, because the system reported: {refused[0]}. The gradebook is"
                f" {gradebook_place(self._root)}.",
                GRADEBOOK_REFUSED,
            )
        self.failures[student] = why

    def _due(self, student: str) -> list[str]:
        """Return the steps of nbgrader that a student needs; empty if neither the result nor a grade has changed.

        The gradebook itself stores what was recorded in it. If an older copy is restored, what it lacks is recorded
        again.
        """
        if self._known is None:
            make_folder(self._root)
            self._known = self._recorded(), self._shown()
        recorded, shown = self._known
        there = self._paths.autograded_notebook(student, self._lab.name).is_file()
        now = own_tables.recordable(self._root, self._lab.name, self._lab.source_digest, student)
        if self._force or not there or recorded.get(student) != now:
            return ["autograde", "generate_feedback"]
        page = self._paths.feedback_page(student, self._lab.name)
        fresh = shows(page, shown.get(student))
        # If a student submits the same work again through the exchange, the secret for the feedback is a new one.
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
    """Records students in a thread, in the order in which they are given.

    Args:
        recorder: the recorder that records each student.
        on_recorded: a function that is called in the recording thread after each student.
    """

    def __init__(self, recorder: Recorder, on_recorded: Callable[[str], None]) -> None:
        """Start the thread, which waits for students."""
        self._recorder, self._on_recorded = recorder, on_recorded
        self._students: queue.SimpleQueue[str | None] = queue.SimpleQueue()
        self._given_up = threading.Event()
        self._error: BaseException | None = None
        self._thread = threading.Thread(target=self._work, name="recording", daemon=True)
        self._thread.start()
        self.seconds = 0.0
        """How many seconds the recorder has worked."""

    def put(self, student: str) -> None:
        """Add a student to those that are recorded.

        Raises:
            KitError: recording an earlier student failed in a way that concerns every student.
        """
        if self._error is not None:
            raise self._error
        self._students.put(student)

    def finish(self) -> None:
        """Wait until all students are recorded.

        Raises:
            KitError: nothing can be recorded, for any student.
        """
        self._students.put(None)
        self._thread.join()
        if self._error is not None:
            raise self._error

    def give_up(self) -> None:
        """Wait until the current student is recorded, and do not record the others."""
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
        except BaseException as error:  # raised again by `put` or `finish`
            self._error = error
