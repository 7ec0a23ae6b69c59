"""Records in a thread of its own: nbgrader is slow and works one by one, while the rest of the class is running."""

from __future__ import annotations

import queue
import threading
import time
from collections.abc import Callable

from autograder.gradebook.recorder import Recorder


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
