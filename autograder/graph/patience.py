"""How much longer a check waits where others withhold the CPUs, and whether that was long enough."""

from __future__ import annotations

import math
import time

from autograder.core.cpu_use import Withheld

PATIENCE = 60.0
"""Seconds that all waits of a check together may take longer on a busy machine."""
STRETCH = 3.0
"""How often its own length one wait may take."""
ALONE = 300.0
"""Seconds by which all waits of a check together may grow where it runs alone; a single wait may take all of them."""
_SHORT = 0.1
"""Seconds after which it pays to measure again what was withheld."""
_TOLERATED = 0.5
"""Seconds that a long wait may lack, and a short one a quarter of its length: nowhere is a CPU free at any moment."""
_SHARE, _SHARE_ALONE = 0.25, 0.5
"""A measurement is trusted if no more than this share of its time was withheld; a median stands up to one half."""


class Patience:
    """Of one check, for all its launches.

    Args:
        alone: whether nothing else of this kit runs meanwhile.
    """

    def __init__(self, alone: bool = False) -> None:
        """All of it is left."""
        self.left = ALONE if alone else PATIENCE
        self.withheld = Withheld()
        self._stretch = math.inf if alone else STRETCH
        self._share = _SHARE_ALONE if alone else _SHARE
        self._lacked = 0.0
        """The most that one of the waits in vain lacked since something was decided last."""
        self._in_vain = 0.0
        """Seconds of those waits together."""
        self._since = time.monotonic()
        """When something was decided last."""
        self._sure = False

    def more(self, began: float, within: float) -> float:
        """Return how many seconds longer a wait may take that began then: as long as its time was withheld."""
        self.withheld.measure(_SHORT)
        return max(0.0, min(self.withheld.from_all(began), (self._stretch - 1) * within, self.left))

    def waited(self, began: float, within: float, came: bool) -> None:
        """Note the end of a wait: what it took longer than asked for, and what it lacked if it was in vain."""
        now = time.monotonic()
        over = now - began - within
        self.left -= max(0.0, over)
        if not came:
            # A wait that was given up early has taken into account already what was withheld.
            lacked = self.kept(began) - over if over >= 0 else 0.0
            if lacked > min(_TOLERATED, within / 4):
                self._lacked = max(self._lacked, lacked)
            self._in_vain += now - began

    def kept(self, when: float) -> float:
        """Return for how many seconds a process had no chance to run, from a moment of the monotonic clock on."""
        self.withheld.measure(_SHORT)
        return self.withheld.from_one(when)

    def passed(self) -> None:
        """Something was decided in favour of the program."""
        self._lacked, self._in_vain, self._since, self._sure = 0.0, 0.0, time.monotonic(), False

    def is_sure(self) -> None:
        """What is decided next is so on every machine, however long it takes to look for the reason."""
        self._sure = True

    def decided(self) -> float:
        """Return the seconds that were lacking for what is decided now, from the last time that something was.

        Zero means that the programs, and who watched them, had their chance to run. What decides is a wait that lacked
        too much, or, where most of the time was no wait in vain, something that was measured in it.
        """
        kept, now = self.kept(self._since), time.monotonic()
        took = now - self._since
        measured = kept if kept > self._share * took and self._in_vain < took / 2 else 0.0
        lacked = 0.0 if self._sure else max(self._lacked, measured)
        self.passed()
        return lacked
