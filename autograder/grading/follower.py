"""Who looks on while the checks of one submission run, and how what a worker says reaches it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Protocol

from pydantic import ValidationError

from autograder.core.results import CheckResult, Outcome
from autograder.course.lab import Cell
from autograder.grading.once_more import is_open
from autograder.grading.validation import believed, was_killed


class Follower(Protocol):
    """Shows what becomes known. It is told in the thread that has asked for the run, and may take its time."""

    def begun(self, problems: Sequence[Outcome]) -> None:
        """The submission has been read: this is wrong with it as a whole."""

    def at(self, worker: int, what: str) -> None:
        """A worker is at this check now; empty: it has nothing more to do."""

    def decided(self, check: CheckResult) -> None:
        """A check came to this; nothing will change that."""


Told = CheckResult | tuple[int, str]
"""A check's result, or which worker is at what."""


class Ear:
    """Hears one worker's results while it still runs, line by line.

    Args:
        worker: its number.
        tell: is called with what is heard, in the thread that reads; it must not wait for anybody.
    """

    def __init__(self, worker: int, tell: Callable[[Told], None]) -> None:
        """Nothing has been heard yet."""
        self._worker, self._tell = worker, tell
        self._left: list[Cell] = []
        self._line = bytearray()
        self._killed: set[str] = set()

    def begin(self, cells: Sequence[Cell]) -> None:
        """A process begins with these checks."""
        self._left, self._line = list(cells), bytearray()
        self._now()

    def hear(self, data: bytes) -> None:
        """It has written more."""
        *ends, rest = data.split(b"\n")
        for end in ends:
            self._line += end
            self._take(bytes(self._line))
            self._line.clear()
        self._line += rest

    def _take(self, line: bytes) -> None:
        try:
            check = CheckResult.model_validate_json(line)
        except ValidationError:
            self._left = []  # no result comes after what is none
            return
        cell = next((one for one in self._left if one.grade_id == check.grade_id), None)
        if cell is not None:
            self._left.remove(cell)
            if was_killed(check) and check.grade_id not in self._killed:
                self._killed.add(check.grade_id)  # it is tried once more
            elif not is_open(check):  # else it is run again, alone, when the others have ended
                self._tell(believed(cell, check))
            self._now()

    def _now(self) -> None:
        self._tell((self._worker, self._left[0].title or self._left[0].grade_id if self._left else ""))
