"""The priority of a program: one that computes on and on lets everyone else go first.

It cannot get its priority back, so it has to be seen to compute on and on: many seconds of CPU within a time in most of
which it wanted to compute, whether it could or not. What a program needs to begin, on whatever machine, is not that.
"""

from __future__ import annotations

import contextlib
import os

from autograder.core.processes import cpu_time, threads, wants_cpu

LAST = 19
"""The nice value of whoever lets everyone else go first (sched(7))."""
_TO_BEGIN = 1.0
"""Seconds of CPU up to which a program is not looked at; a node that rests never has more."""
_ON_AND_ON = 10.0
"""Seconds of CPU within the time that is judged."""
_LOOKS = 50
"""After so many looks a new time begins if the program did not want to compute in most of them."""


class Priority:
    """The priority of one program, which is looked at now and then."""

    def __init__(self) -> None:
        """Begin with that of everyone."""
        self._behind = False
        self._looks = self._wanted = 0
        """Looks since this time began, and those at which the program wanted to compute."""
        self._before = 0.0
        """Seconds of CPU that it had had when this time began."""

    def look(self, pid: int) -> None:
        """Give all threads of the program the lowest priority if it computes on and on, whatever it gave to some.

        The programs of its launch, and of others, come before it then. Where each session has its share of the CPUs
        (sched(7), the autogroup feature) it takes no more than one session's, with however many threads: each program
        is a session of its own.

        Args:
            pid: of the program.
        """
        with contextlib.suppress(OSError):
            self._behind = self._behind or self._goes_on_and_on(pid)
            # Linux keeps a nice value for each thread; threads inherit that of the thread that starts them.
            for thread in threads(pid) if self._behind else ():
                with contextlib.suppress(ProcessLookupError):
                    if os.getpriority(os.PRIO_PROCESS, thread) < LAST:
                        os.setpriority(os.PRIO_PROCESS, thread, LAST)

    def _goes_on_and_on(self, pid: int) -> bool:
        used = cpu_time(pid)
        if used < _TO_BEGIN:
            return False
        self._looks += 1
        self._wanted += wants_cpu(pid)
        if 2 * self._wanted > self._looks:
            return used - self._before > _ON_AND_ON
        if self._looks >= _LOOKS:
            self._looks, self._wanted, self._before = 0, 0, used
        return False
