"""Reading the process list: who descends from whom, how much memory is whose, and who waits for a CPU."""

from __future__ import annotations

import contextlib
import os
import time
from dataclasses import dataclass
from pathlib import Path

_HAD_ITS_CHANCE = 3.0
"""Seconds of CPU in one wait after which a process was not kept from anything; a node starts in a third of one."""
_BEGINNING = 1.0
"""Seconds of CPU that a program may take to begin; one that computes on takes what it gets, and waits for ever."""


@dataclass(frozen=True)
class Process:
    """One line of the process list."""

    pid: int
    parent: int
    session: int
    threads: int


def descendants(root: int) -> dict[int, Process]:
    """Return the living processes below `root`, without itself. What cannot be read has just ended."""
    everyone: dict[int, list[str]] = {}
    children: dict[int, list[int]] = {}
    for entry in os.listdir("/proc"):
        if not entry.isdigit():
            continue
        with contextlib.suppress(OSError):
            fields = Path(f"/proc/{entry}/stat").read_text().rpartition(")")[2].split()
            if fields[0] in "ZX":
                continue
            everyone[int(entry)] = fields
            children.setdefault(int(fields[1]), []).append(int(entry))
    found: dict[int, Process] = {}
    front = [root]
    while front:
        for pid in children.get(front.pop(), []):
            fields = everyone[pid]
            found[pid] = Process(pid, int(fields[1]), int(fields[3]), int(fields[17]))
            front.append(pid)
    return found


def memory(pid: int) -> int:
    """Return the bytes of memory, swapped out or not, that belong to no file; 0 if the process is gone.

    What is mapped to be shared counts in full, and so do pages that a fork still shares.
    """
    total = 0
    with contextlib.suppress(OSError):
        for line in Path(f"/proc/{pid}/status").read_text().splitlines():
            if line.startswith(("RssAnon:", "RssShmem:", "VmSwap:")):
                total += int(line.split()[1]) * 1024
    return total


def proportional_memory(pid: int) -> int:
    """Return the bytes of memory that are this process's own; a shared page counts in parts. 0 if it is gone."""
    total = 0
    with contextlib.suppress(OSError):
        for line in Path(f"/proc/{pid}/smaps_rollup").read_text().splitlines():
            if line.startswith(("Pss:", "SwapPss:")):
                total += int(line.split()[1]) * 1024
    return total


def cpu_time(pid: int) -> float:
    """Return the seconds of CPU that a process has had, with those of its children that have ended; 0 if it is gone."""
    with contextlib.suppress(OSError):
        fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
        return sum(map(int, fields[11:15])) / os.sysconf("SC_CLK_TCK")
    return 0.0


def pid_of(handle: int) -> int:
    """Return the process id, as this process sees it, behind a pidfd; -1 if it has been reaped."""
    for line in Path(f"/proc/self/fdinfo/{handle}").read_text().splitlines():
        if line.startswith("Pid:"):
            return int(line.split()[1])
    return -1


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
        return self.cpu > _BEGINNING and self.cpu > free / 2


def cpu_uses() -> dict[int, CpuUse]:
    """Return what this process and its descendants have had of the CPUs, by process.

    Empty where the kernel does not count that (proc(5), `/proc/PID/schedstat`).
    """
    uses: dict[int, CpuUse] = {}
    for pid in (os.getpid(), *descendants(os.getpid())):
        with contextlib.suppress(OSError, IndexError, ValueError):
            fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
            began = int(fields[19]) / os.sysconf("SC_CLK_TCK")
            threads = _cpu_waits(pid)
            if threads:
                uses[pid] = CpuUse(cpu_time(pid), time.clock_gettime(time.CLOCK_BOOTTIME) - began, threads)
    return uses


def _cpu_waits(pid: int) -> dict[int, CpuWait]:
    waits: dict[int, CpuWait] = {}
    for task in os.listdir(f"/proc/{pid}/task"):
        with contextlib.suppress(OSError, IndexError, ValueError):
            folder = Path(f"/proc/{pid}/task/{task}")
            _, waited, turns = map(int, (folder / "schedstat").read_text().split())
            state = (folder / "stat").read_text().rpartition(")")[2].split()[0]
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
        if used[pid] > _HAD_ITS_CHANCE or (pid != os.getpid() and use.computes()):
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
