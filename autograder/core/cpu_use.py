"""Who waits for a CPU: what the processes of a launch have had of them, and by how much that made a message late."""

from __future__ import annotations

import contextlib
import os
import time
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path, PurePosixPath

from autograder.core.processes import cpu_time, descendants, read_text, stat_fields, threads

_CPU_TO_BEGIN = 1.0
"""Seconds of CPU that a program may take to begin; one that computes on takes what it gets."""
_PIECE = 1.0
"""Seconds between two measurements."""
_CPUS = "AUTOGRADER_CPUS"
_TICKS = os.sysconf("SC_CLK_TCK")
"""How many of the kernel's units of time a second has."""


@dataclass(frozen=True)
class CpuWait:
    """What a thread has had of the CPUs."""

    when: float
    """Seconds on the monotonic clock at which this was read."""
    used: float
    """Seconds for which it ran."""
    waited: float
    """Seconds for which it was ready to run and got no CPU, up to its last turn."""
    turns: int
    """How often it got one."""
    ready: bool
    """Whether it runs or waits for its turn now."""


@dataclass(frozen=True)
class CpuUse:
    """What a process has had of the CPUs."""

    own: float
    """Seconds, of all its threads, those that have ended included."""
    age: float
    """Seconds since it began."""
    threads: dict[int, CpuWait]
    children: float = 0.0
    """Seconds of those of its children that have ended."""

    def computes(self) -> bool:
        """Whether it has computed for most of the time in which nobody kept it from that."""
        free = self.age - max((wait.waited for wait in self.threads.values()), default=0.0)
        cpu = self.own + self.children
        return cpu > _CPU_TO_BEGIN and cpu > free / 2


def computes(pid: int) -> bool:
    """Whether a process has computed for most of the time in which nobody kept it from that."""
    if cpu_time(pid) <= _CPU_TO_BEGIN:
        return False
    with contextlib.suppress(OSError, IndexError, ValueError):
        return _use(pid).computes()
    return False


def cpu_uses() -> dict[int, CpuUse]:
    """Return what this process and its descendants have had of the CPUs, by process.

    Empty where the kernel does not count that (proc(5), `/proc/PID/schedstat`).
    """
    uses: dict[int, CpuUse] = {}
    for pid in (os.getpid(), *descendants(os.getpid())):
        with contextlib.suppress(OSError, IndexError, ValueError):
            use = _use(pid)
            if use.threads:
                uses[pid] = use
    return uses


def _use(pid: int) -> CpuUse:
    fields = stat_fields(f"/proc/{pid}")
    user, system, childrens_user, childrens_system, *_, began = (int(field) / _TICKS for field in fields[11:20])
    age = time.clock_gettime(time.CLOCK_BOOTTIME) - began
    return CpuUse(user + system, age, _cpu_waits(pid), childrens_user + childrens_system)


def _cpu_waits(pid: int) -> dict[int, CpuWait]:
    waits: dict[int, CpuWait] = {}
    for task in threads(pid):
        with contextlib.suppress(OSError, IndexError, ValueError):
            folder = f"/proc/{pid}/task/{task}"
            used, waited, turns = map(int, read_text(f"{folder}/schedstat").split())
            state = stat_fields(folder)[0]
            waits[task] = CpuWait(time.monotonic(), used / 1e9, waited / 1e9, turns, state == "R")
    return waits


def kept_waiting(before: dict[int, CpuUse], after: dict[int, CpuUse], share: float = 1.0) -> dict[int, float]:
    """Return by how many seconds each of these processes may have been late because of others.

    The CPU time of the other threads of this launch is subtracted from a wait, because they may have caused that part
    themselves. So a program that computes all the time, in however many threads and processes, gains nothing by it. The
    threads of a process wait side by side.

    Args:
        before: what each of them had of the CPUs.
        after: and what it had later.
        share: of one CPU that all of them together may have; 1.0 if they may have a whole one. A program that computes
            all the time uses up the quota, and then every process waits.
    """
    weight = {pid: 1 / share if pid != os.getpid() and use.computes() else 1.0 for pid, use in after.items()}
    together = sum(weight[pid] * (use.own - (before[pid].own if pid in before else 0.0)) for pid, use in after.items())
    # What has ended is in its parent's account now, with all that it had before this piece.
    ended = sum(use.children for use in after.values()) - sum(before[pid].children for pid in before if pid in after)
    known_before = sum(use.own + use.children for pid, use in before.items() if pid not in after)
    together += max(0.0, ended - known_before) / share
    kept = {}
    for pid, use in after.items():
        known = before[pid].threads if pid in before else {}
        waits = [_since(known.get(thread), wait) for thread, wait in use.threads.items()]
        kept[pid] = max(0.0, *(waited - max(0.0, together - own) for waited, own in waits))
    return kept


def _since(before: CpuWait | None, after: CpuWait) -> tuple[float, float]:
    """For how many seconds a thread has waited since then, and for how many it ran."""
    if before is None:
        before = CpuWait(after.when, 0.0, 0.0, 0, ready=False)
    used = after.used - before.used
    if _still_waits(before, after):
        return max(0.0, after.when - before.when - used), used
    return max(0.0, after.waited - before.waited), used


def _still_waits(before: CpuWait, after: CpuWait) -> bool:
    """Whether a thread has waited, or run, without a break since then: the kernel adds a wait when it is over."""
    return after.ready and before.ready and after.turns == before.turns


def _with_open_waits(before: dict[int, CpuUse], after: dict[int, CpuUse]) -> dict[int, CpuUse]:
    """Return what the processes had later, with the waits that are not over, so that none is counted a second time."""
    noted = {}
    for pid, use in after.items():
        threads = dict(use.threads)
        for thread, known in before[pid].threads.items() if pid in before else ():
            if thread in threads and _still_waits(known, threads[thread]):
                waited, _ = _since(known, threads[thread])
                threads[thread] = replace(threads[thread], waited=known.waited + waited)
        noted[pid] = replace(use, threads=threads)
    return noted


class Withheld:
    """The time that others have withheld from the processes of a launch, and from the one that watches it.

    It is measured piece by piece: what these processes used in one second does not excuse what others took in another.
    """

    def __init__(self) -> None:
        """Nothing has been measured yet."""
        self._share = min(1.0, cpus())
        self._before: tuple[float, dict[int, CpuUse]] | None = None
        self._pieces: list[tuple[float, float, float, float]] = []
        """Of each piece when it began and ended, and what was withheld in it: from all together, and from one."""

    def measure(self, least: float = _PIECE) -> None:
        """Measure up to now, if the last time was at least so many seconds ago."""
        now = time.monotonic()
        if self._before is not None and now - self._before[0] < least:
            return
        uses = cpu_uses()
        if self._before is not None:
            kept = kept_waiting(self._before[1], uses, self._share).values()
            self._pieces.append((self._before[0], now, sum(kept), max(kept, default=0.0)))
            uses = _with_open_waits(self._before[1], uses)
        self._before = now, uses

    def from_all(self, when: float) -> float:
        """Return by how many seconds a message may have come late that went through all the processes, one by one.

        Args:
            when: seconds on the monotonic clock; what was withheld before that does not count.
        """
        return sum(kept * min(1.0, (end - when) / (end - begin)) for begin, end, kept, _ in self._pieces if end > when)

    def from_one(self, when: float) -> float:
        """Return for how many seconds, at the most, a single process had no chance to run; `when` as in `from_all`."""
        return sum(kept * min(1.0, (end - when) / (end - begin)) for begin, end, _, kept in self._pieces if end > when)


def cpus() -> float:
    """Return how many CPUs this process and those below it may have together; less than one with a small quota."""
    given = os.environ.get(_CPUS)
    return float(given) if given else min([float(len(os.sched_getaffinity(0))), *_quotas()])


def _quotas() -> Iterator[float]:
    """The CPUs that each control group around this process may use (cgroups(7), in either version)."""
    with contextlib.suppress(OSError):
        for line in Path("/proc/self/cgroup").read_text().splitlines():
            _, kinds, path = line.split(":", 2)
            if kinds and "cpu" not in kinds.split(","):
                continue
            inner = PurePosixPath(path)
            for root in ("/sys/fs/cgroup", "/sys/fs/cgroup/cpu", "/sys/fs/cgroup/unified"):
                for folder in (inner, *inner.parents):
                    yield from _quota(Path(root + str(folder)))


def _quota(group: Path) -> Iterator[float]:
    with contextlib.suppress(OSError, ValueError):
        quota, period = (group / "cpu.max").read_text().split()
        if quota != "max":
            yield int(quota) / int(period)
    with contextlib.suppress(OSError, ValueError):
        quota = (group / "cpu.cfs_quota_us").read_text()
        if int(quota) > 0:
            yield int(quota) / int((group / "cpu.cfs_period_us").read_text())


def cpus_environment() -> dict[str, str]:
    """Return the variable that tells a process in a sandbox, which sees no control group, of `cpus`."""
    return {_CPUS: f"{cpus():g}"}
