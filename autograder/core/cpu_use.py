"""Who waits for a CPU: what the processes of a launch have had of them, and by how much that made a message late."""

from __future__ import annotations

import contextlib
import os
import time
from dataclasses import dataclass

from autograder.core.processes import cpu_time, descendants, read_text, stat_fields

_NOT_KEPT_FROM_ANYTHING = 3.0
"""Seconds of CPU in one wait after which a process was not kept from anything; a node starts in a third of one."""
_CPU_TO_BEGIN = 1.0
"""Seconds of CPU that a program may take to begin; one that computes on takes what it gets, and always waits."""


@dataclass(frozen=True)
class CpuWait:
    """What a thread has had of the CPUs."""

    when: float
    """Seconds on the monotonic clock at which this was read."""
    waited: float
    """Seconds for which it was ready to run and got no CPU, up to its last turn."""
    turns: int
    """How often it got one."""
    ready: bool
    """Whether it runs or waits for its turn now."""


@dataclass(frozen=True)
class CpuUse:
    """What a process has had of the CPUs."""

    cpu: float
    """Seconds, of all its threads, those that have ended included."""
    age: float
    """Seconds since it began."""
    threads: dict[int, CpuWait]

    def computes(self) -> bool:
        """Whether it has computed for most of the time in which nobody kept it from that."""
        free = self.age - max((wait.waited for wait in self.threads.values()), default=0.0)
        return self.cpu > _CPU_TO_BEGIN and self.cpu > free / 2


def cpu_uses() -> dict[int, CpuUse]:
    """Return what this process and its descendants have had of the CPUs, by process.

    Empty where the kernel does not count that (proc(5), `/proc/PID/schedstat`).
    """
    uses: dict[int, CpuUse] = {}
    for pid in (os.getpid(), *descendants(os.getpid())):
        with contextlib.suppress(OSError, IndexError, ValueError):
            fields = stat_fields(f"/proc/{pid}")
            began = int(fields[19]) / os.sysconf("SC_CLK_TCK")
            threads = _cpu_waits(pid)
            if threads:
                uses[pid] = CpuUse(cpu_time(pid), time.clock_gettime(time.CLOCK_BOOTTIME) - began, threads)
    return uses


def _cpu_waits(pid: int) -> dict[int, CpuWait]:
    waits: dict[int, CpuWait] = {}
    for task in os.listdir(f"/proc/{pid}/task"):
        with contextlib.suppress(OSError, IndexError, ValueError):
            folder = f"/proc/{pid}/task/{task}"
            _, waited, turns = map(int, read_text(f"{folder}/schedstat").split())
            state = stat_fields(folder)[0]
            waits[int(task)] = CpuWait(time.monotonic(), waited / 1e9, turns, state == "R")
    return waits


def kept_waiting(before: dict[int, CpuUse], after: dict[int, CpuUse]) -> float:
    """Return by how many seconds a message through all these processes may have come late because of others.

    It passes one process after another, so their waits add up; the threads of one wait side by side. Not counted are
    the waits of a program that computes on and on, and of any process as long as its own kind may have caused: the time
    for which the rest of these processes had a CPU.
    """
    used = {pid: use.cpu - (before[pid].cpu if pid in before else 0.0) for pid, use in after.items()}
    together = sum(used.values())
    kept = 0.0
    for pid, use in after.items():
        if used[pid] > _NOT_KEPT_FROM_ANYTHING or (pid != os.getpid() and use.computes()):
            continue
        known = before[pid].threads if pid in before else {}
        waited = max(_waited_since(known.get(thread), wait) for thread, wait in use.threads.items())
        kept += max(0.0, waited - (together - used[pid]))
    return kept


def _waited_since(before: CpuWait | None, after: CpuWait) -> float:
    if before is None:
        before = CpuWait(after.when, 0.0, 0, ready=False)
    if after.ready and before.ready and after.turns == before.turns:
        return after.when - before.when  # the kernel adds a wait when it is over, and this one is not
    return after.waited - before.waited
