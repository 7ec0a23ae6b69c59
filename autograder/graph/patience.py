"""Decides how much longer a check waits if other processes withhold the CPUs, and whether that was long enough."""

from __future__ import annotations

import math
import time

from autograder.core.cpu_use import Withheld

PATIENCE = 60.0
"""The seconds by which all waits of a check together may be extended on a busy machine."""
STRETCH = 3.0
"""One wait may take at most this many times its requested length."""
ALONE = 300.0
"""The seconds by which all waits of a check that runs alone may be extended; one wait may use all of them."""
_SHORT = 0.1
"""The seconds after which it is worth measuring again how much CPU time was withheld."""
_TOLERATED = 0.5
"""The seconds of CPU time that a long wait may lack; a short one may lack a quarter of its length. Some lack is normal
on every machine."""
_HELD_UP = 1.0
"""The seconds that a process may lose in a row before a check that is not run alone is run again if it fails.

What the process did late may be judged long after that, when other expectations have passed: a goal that was sent too
late has a wrong stamp ten seconds later."""
_NORMAL = 0.05
"""The share of a measurement's time that is withheld on every machine now and then."""
_SHARE, _SHARE_ALONE = 0.25, 0.5
"""A measurement is trusted if no more than this share of its time was withheld, first on a shared machine and then for
a check that runs alone. Medians are reliable as long as no more than half of the time was withheld."""


class Patience:
    """The patience of one check, for all its launches.

    Args:
        alone: whether nothing else of this kit runs at the same time.
    """

    def __init__(self, alone: bool = False) -> None:
        """Begin with all of it left."""
        self.left = ALONE if alone else PATIENCE
        self.withheld = Withheld()
        self._alone = alone
        self._stretch = math.inf if alone else STRETCH
        self._share = _SHARE_ALONE if alone else _SHARE
        self._lacked = 0.0
        """The largest number of seconds that a failed wait or a measurement lacked since the last decision."""
        self._in_vain = 0.0
        """The seconds that the failed waits since the last decision took together."""
        self._since = time.monotonic()
        """When the last decision was made."""
        self._sure = False

    def more(self, began: float, within: float) -> float:
        """Return by how many seconds a wait may be extended: by the time that was withheld from it, within the limits.

        Args:
            began: when the wait began, on the monotonic clock.
            within: its requested length in seconds.
        """
        self.withheld.measure(_SHORT)
        return max(0.0, min(self.withheld.from_all(began), (self._stretch - 1) * within, self.left))

    def waited(self, began: float, within: float, came: bool) -> None:
        """Record the end of a wait: how much longer it took than requested, and what it lacked if it failed."""
        now = time.monotonic()
        over = now - began - within
        self.left -= max(0.0, over)
        if not came:
            # A wait that was given up early lacks nothing: giving it up took what was withheld into account already.
            lacked = self.kept(began) - over if over >= 0 else 0.0
            if lacked > min(_TOLERATED, within / 4):
                self._lacked = max(self._lacked, lacked)
            self._in_vain += now - began

    def was_slow(self, since: float, gap: float, allowed: float) -> None:
        """Record that something took place less often than it should, and what it lacked if it had to wait for a CPU.

        A loop that sleeps makes its gaps longer by all that is withheld from it. It lacks this time if its gaps would
        have been short enough without it.

        Args:
            since: when this began, on the monotonic clock.
            gap: the seconds between two times that it took place.
            allowed: the longest gap that would do, in seconds.
        """
        kept = self.kept(since)
        share = kept / (time.monotonic() - since)
        if share > _NORMAL and gap * (1 - share) <= allowed < gap:
            self._lacked = max(self._lacked, kept)

    def kept(self, when: float) -> float:
        """Return for how many seconds a process could not run since a moment on the monotonic clock."""
        self.withheld.measure(_SHORT)
        return self.withheld.from_one(when)

    def passed(self) -> None:
        """Record a decision in favour of the program."""
        self._lacked, self._in_vain, self._since, self._sure = 0.0, 0.0, time.monotonic(), False

    def is_sure(self) -> None:
        """Record that the next decision is the same on every machine, however long it takes to find the reason."""
        self._sure = True

    def decided(self) -> float:
        """Make a decision, and return the seconds of CPU time that were lacking for it since the last one.

        Zero means that the programs and the observer had enough time to run. What counts is how much the failed wait
        with the greatest lack was lacking. If failed waits took less than half of the time, what was withheld from the
        whole time counts, too, if its share is too large. In a check that is not run alone, a process that was held up
        at any time before counts, too.
        """
        kept, now = self.kept(self._since), time.monotonic()
        took = now - self._since
        measured = kept if kept > self._share * took and self._in_vain < took / 2 else 0.0
        held_up = 0.0 if self._alone else self.withheld.longest()
        lacked = 0.0 if self._sure else max(self._lacked, measured, held_up if held_up >= _HELD_UP else 0.0)
        self.passed()
        return lacked
