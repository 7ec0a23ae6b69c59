"""Measure how much CPU time the processes of a launch got, and how late a message may be because they had to wait."""

from __future__ import annotations

import contextlib
import os
import time
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path, PurePosixPath

from autograder.core.processes import cpu_time, descendants, read_text, stat_fields, threads

_CPU_TO_BEGIN = 1.0
"""Seconds of CPU time that any program may need to start. A program that keeps computing uses all it can get."""
_PIECE = 1.0
"""Seconds between two measurements."""
_CPUS = "AUTOGRADER_CPUS"
_TICKS = os.sysconf("SC_CLK_TCK")
"""The number of the kernel's clock ticks in one second."""


@dataclass(frozen=True)
class CpuWait:
    """How long a thread has run on a CPU and has waited for one."""

    when: float
    """The time of the reading, in seconds on the monotonic clock."""
    used: float
    """Seconds for which the thread ran."""
    waited: float
    """Seconds for which the thread was ready to run but got no CPU, up to the last time it got one."""
    turns: int
    """How often the thread got a CPU."""
    ready: bool
    """Whether the thread now runs or waits for a CPU."""


@dataclass(frozen=True)
class CpuUse:
    """How much CPU time a process has used, and how long its threads have waited for a CPU."""

    own: float
    """Seconds of CPU time that all threads of the process have used, including threads that have ended."""
    age: float
    """Seconds since the process started."""
    threads: dict[int, CpuWait]
    children: float = 0.0
    """Seconds of CPU time that the child processes have used which have ended."""

    def computes(self) -> bool:
        """Return whether the process has computed for most of the time in which it did not have to wait for a CPU."""
        free = self.age - max((wait.waited for wait in self.threads.values()), default=0.0)
        cpu = self.own + self.children
        return cpu > _CPU_TO_BEGIN and cpu > free / 2


def computes(pid: int) -> bool:
    """Return whether a process has computed for most of the time in which it did not have to wait for a CPU."""
    if cpu_time(pid) <= _CPU_TO_BEGIN:
        return False
    with contextlib.suppress(OSError, IndexError, ValueError):
        return _use(pid).computes()
    return False


_above: list[int] = []
"""The process whose descendants count, if it is not this one."""


def count_all_below(pid: int) -> None:
    """From now on, count the CPU time of all descendants of a process, of which this process is one."""
    _above[:] = [pid]


def cpu_uses() -> dict[int, CpuUse]:
    """Return how much CPU time this process and its descendants have used, by process id.

    The result is empty if the kernel does not count it (see `/proc/PID/schedstat` in proc(5)).
    """
    uses: dict[int, CpuUse] = {}
    for pid in (os.getpid(), *descendants(_above[0] if _above else os.getpid())):
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
    """Return by how many seconds each of these processes may have been late because of other programs.

    The CPU time of the other threads of this launch is subtracted from a wait, because they may have caused that part
    of it. A program that computes all the time therefore gains nothing, however many threads and processes it has. The
    threads of a process wait at the same time, so only the longest wait counts.

    Args:
        before: the CPU use of each process at the start of the period.
        after: the CPU use of each process at the end of the period.
        share: the part of one CPU that all processes together may use; 1.0 if they may use a whole CPU or more. A
            program that computes all the time uses up the quota, and then every process waits.
    """
    together = _used_together(before, after, share)
    kept = {}
    for pid, use in after.items():
        known = before[pid].threads if pid in before else {}
        waits = [_since(known.get(thread), wait) for thread, wait in use.threads.items()]
        kept[pid] = max(0.0, *(waited - max(0.0, together - own) for waited, own in waits))
    return kept


def _used_together(before: dict[int, CpuUse], after: dict[int, CpuUse], share: float) -> float:
    """Return the seconds of CPU time that all processes used in a period; for `share` see `kept_waiting`."""
    weight = {pid: 1 / share if pid != os.getpid() and use.computes() else 1.0 for pid, use in after.items()}
    together = sum(weight[pid] * (use.own - (before[pid].own if pid in before else 0.0)) for pid, use in after.items())
    # The CPU time of a process that has ended now belongs to its parent, including the time from before this period.
    ended = sum(use.children for use in after.values()) - sum(before[pid].children for pid in before if pid in after)
    known_before = sum(use.own + use.children for pid, use in before.items() if pid not in after)
    return together + max(0.0, ended - known_before) / share


def _since(before: CpuWait | None, after: CpuWait) -> tuple[float, float]:
    """Return for how many seconds a thread has waited between two readings, and for how many it ran."""
    if before is None:
        before = CpuWait(after.when, 0.0, 0.0, 0, ready=False)
    used = after.used - before.used
    if _still_waits(before, after):
        return max(0.0, after.when - before.when - used), used
    return max(0.0, after.waited - before.waited), used


def _still_waits(before: CpuWait, after: CpuWait) -> bool:
    """Return whether a thread has waited, or run, without a break between two readings.

    The kernel counts a wait only when it is over.
    """
    return after.ready and before.ready and after.turns == before.turns


def _with_open_waits(before: dict[int, CpuUse], after: dict[int, CpuUse]) -> dict[int, CpuUse]:
    """Return the later CPU use with the waits that are not over added, so that they are not counted a second time."""
    noted = {}
    for pid, use in after.items():
        threads = dict(use.threads)
        for thread, known in before[pid].threads.items() if pid in before else ():
            if thread in threads and _still_waits(known, threads[thread]):
                waited, _ = _since(known, threads[thread])
                threads[thread] = replace(threads[thread], waited=known.waited + waited)
        noted[pid] = replace(use, threads=threads)
    return noted


def stolen(stat: str = "/proc/stat") -> list[float]:
    """Return for how many seconds each CPU of a virtual machine had work while its host ran something else.

    The kernel counts this time as neither use nor wait of any process (`steal` in proc(5)). A machine of one's own has
    none. The result is empty if it is not known.

    Args:
        stat: the file in which the kernel counts.
    """
    with contextlib.suppress(OSError, IndexError, ValueError):
        lines = [line.split() for line in read_text(stat).splitlines() if line.startswith("cpu")]
        return [int(fields[8]) / _TICKS for fields in lines if fields[0] != "cpu"]
    return []


class Withheld:
    """The time for which other programs kept the processes of a launch, and the process that watches it, from the CPUs.

    It is measured in short periods, so that CPU time that these processes used in one second is not subtracted from
    what other programs took in another second.

    Args:
        stat: the file in which the kernel counts what a host takes from its virtual machines (see `stolen`).
    """

    def __init__(self, stat: str = "/proc/stat") -> None:
        """Start without any measurement."""
        self._share = min(1.0, cpus())
        self._stat = stat
        self._before: tuple[float, dict[int, CpuUse], list[float]] | None = None
        self._pieces: list[tuple[float, float, float, float]] = []
        """For each period: its start, its end, the seconds that all processes lost, and the most that one lost."""

    def measure(self, least: float = _PIECE) -> None:
        """Measure up to now, unless the last measurement was less than `least` seconds ago."""
        now = time.monotonic()
        if self._before is not None and now - self._before[0] < least:
            return
        uses, by_host = cpu_uses(), stolen(self._stat)
        if self._before is not None:
            began, before, by_host_before = self._before
            kept = kept_waiting(before, uses, self._share).values()
            taken = [after - earlier for after, earlier in zip(by_host, by_host_before, strict=False)]
            # A host that lends its CPUs sparingly takes them from a program that computes all the time.
            own = _used_together(before, uses, self._share) if any(taken) else 0.0
            all_lost = min(now - began, max(0.0, sum(taken) - own))
            one_lost = min(now - began, max(0.0, max(taken, default=0.0) - own))
            # The kernel counts a stolen moment as a wait of the processes that are queued, but not of the one that ran.
            self._pieces.append((began, now, sum(kept) + all_lost, max([one_lost, *kept])))
            uses = _with_open_waits(before, uses)
        self._before = now, uses, by_host

    def from_all(self, when: float) -> float:
        """Return by how many seconds a message may be late if it went through all the processes, one after another.

        Args:
            when: the start of the time that counts, in seconds on the monotonic clock.
        """
        return sum(kept * min(1.0, (end - when) / (end - begin)) for begin, end, kept, _ in self._pieces if end > when)

    def from_one(self, when: float) -> float:
        """Return the most seconds for which a single process was kept from running; for `when` see `from_all`."""
        return sum(kept * min(1.0, (end - when) / (end - begin)) for begin, end, _, kept in self._pieces if end > when)

    def longest(self) -> float:
        """Return the most seconds that a single process lost in a row, which means for more than half of some time."""
        most = 0.0
        for number, (began, *_) in enumerate(self._pieces):
            lost = 0.0
            for _, end, _, kept in self._pieces[number:]:
                lost += kept
                if lost > (end - began) / 2:
                    most = max(most, lost)
        return most


def idle() -> float:
    """Return for how many seconds the CPUs that this process may use had nothing to do, on average, since the start.

    The result is always 0 if this is not known, or if a quota limits what this process and its descendants compute.
    """
    mine = os.sched_getaffinity(0)
    if cpus() < len(mine):
        return 0.0
    with contextlib.suppress(OSError, IndexError, ValueError):
        lines = [line.split() for line in read_text("/proc/stat").splitlines() if line.startswith("cpu")]
        free = [int(fields[4]) + int(fields[5]) for fields in lines if fields[0] in {f"cpu{number}" for number in mine}]
        return sum(free) / _TICKS / len(mine)
    return 0.0


def cpus() -> float:
    """Return how many CPUs this process and its descendants may use together; less than 1 if the quota is small."""
    given = os.environ.get(_CPUS)
    return float(given) if given else min([float(len(os.sched_getaffinity(0))), *_quotas()])


def _quotas() -> Iterator[float]:
    """Yield how many CPUs each control group around this process may use (cgroups(7), version 1 or 2)."""
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
    """Return an environment variable that gives `cpus` to a process in a sandbox, which cannot see control groups."""
    return {_CPUS: f"{cpus():g}"}
