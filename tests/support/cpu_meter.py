"""How much CPU a command and all that it starts have had, and which part of grading had it."""

from __future__ import annotations

import contextlib
import functools
import itertools
import os
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path

from autograder.core.processes import descendants, read_text, stat_fields

PARTS = (
    "students' programs", "launchers", "workers", "fork server", "bubblewrap", "grading command: nbgrader, feedback"
)  # fmt: skip
_NUMBER = itertools.count()
"""Of the control groups of this process."""
_LOOK_EVERY = 0.05
"""Seconds between two looks at who has had how much CPU."""


@contextlib.contextmanager
def cpu_meter() -> Iterator[tuple[list[str], Callable[[], float]]]:
    """Give the words to put before a command, and what tells the CPU seconds of it and its descendants.

    A control group counts them all. Where none can be made (it takes root), the machine's own count is taken, which is
    right only if nothing else runs: the kernel forgets the time of processes that end with their process namespace.
    """
    for hierarchy in (Path("/sys/fs/cgroup/cpuacct"), Path("/sys/fs/cgroup")):
        group = hierarchy / f"bench-{os.getpid()}-{next(_NUMBER)}"
        if not (hierarchy / "cgroup.procs").exists():
            continue
        try:
            group.mkdir()
        except OSError:
            continue
        join = ["/bin/sh", "-c", f'echo $$ > {group}/cgroup.procs; exec "$@"', "join"]
        try:
            yield join, functools.partial(_group_seconds, group)
        finally:
            wait_until_empty(group)
            group.rmdir()
        return
    before = machine_seconds()
    yield [], lambda: machine_seconds() - before


def _group_seconds(group: Path) -> float:
    nanoseconds = group / "cpuacct.usage"
    if nanoseconds.exists():
        return int(nanoseconds.read_text()) / 1e9
    return int((group / "cpu.stat").read_text().split("usage_usec ")[1].split()[0]) / 1e6


def wait_until_empty(group: Path) -> None:
    """Wait, at most 30 s, until no process is left in the group: only then can it be removed."""
    deadline = time.monotonic() + 30
    while (group / "cgroup.procs").read_text() and time.monotonic() < deadline:
        time.sleep(0.05)


def machine_seconds() -> float:
    """CPU seconds since the machine started, of all that ran on it."""
    user, nice, system, _idle, _iowait, *interrupts = map(
        int, Path("/proc/stat").read_text().splitlines()[0].split()[1:]
    )
    return (user + nice + system + sum(interrupts[:2])) / os.sysconf("SC_CLK_TCK")


@contextlib.contextmanager
def shares_of_cpu() -> Iterator[dict[str, float]]:
    """Give a table of CPU seconds by part, filled at the end of the block, of all that this process starts in it."""
    seen: dict[tuple[int, str], tuple[str, float]] = {}
    parts = dict.fromkeys(PARTS, 0.0)
    over = threading.Event()

    def watch() -> None:
        while not over.wait(_LOOK_EVERY):
            for pid in descendants(os.getpid()):
                with contextlib.suppress(OSError, IndexError, ValueError):
                    fields = stat_fields(f"/proc/{pid}")
                    own = sum(map(int, fields[11:13])) / os.sysconf("SC_CLK_TCK")
                    seen[pid, fields[19]] = part_of(pid), own  # a number is given again, with another start

    thread = threading.Thread(target=watch)
    thread.start()
    try:
        yield parts
    finally:
        over.set()
        thread.join()
        for part, seconds in seen.values():
            parts[part] += seconds


def part_of(pid: int) -> str:
    """Which of `PARTS` a process below this one belongs to."""
    words = read_text(f"/proc/{pid}/cmdline").split("\0")
    if words[0].endswith("bwrap"):
        return "bubblewrap"
    if any(word.endswith("launcher.py") for word in words):
        status = read_text(f"/proc/{pid}/status")
        first = status.partition("NSpid:")[2].partition("\n")[0].split()[-1] == "1"  # of its namespace: of a launch
        return "students' programs" if "\nSeccomp:\t2" in status and not first else "launchers"
    if any(word.endswith("fork_server") for word in words):
        return "workers" if read_text(f"/proc/{pid}/comm").strip() == "worker" else "fork server"
    return "grading command: nbgrader, feedback"
