"""Reading the process list: who descends from whom, how much memory and CPU time is whose."""

from __future__ import annotations

import contextlib
import os
from dataclasses import dataclass
from pathlib import Path


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
