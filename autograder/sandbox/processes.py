"""Reading the process list: who descends from whom, and how much memory is whose."""

from __future__ import annotations

import contextlib
import os
from dataclasses import dataclass
from pathlib import Path

_PAGE = os.sysconf("SC_PAGE_SIZE")


@dataclass(frozen=True)
class Process:
    """One line of the process list."""

    pid: int
    parent: int
    session: int
    threads: int
    anonymous: int
    """Resident bytes that belong to no file; pages shared after a fork are counted for both sides."""


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
            with contextlib.suppress(OSError, IndexError):
                sizes = Path(f"/proc/{pid}/statm").read_text().split()
                fields = everyone[pid]
                found[pid] = Process(
                    pid, int(fields[1]), int(fields[3]), int(fields[17]), (int(sizes[1]) - int(sizes[2])) * _PAGE
                )
            front.append(pid)
    return found


def proportional_memory(pid: int) -> int:
    """Return the bytes of memory that are this process's own; a shared page counts in parts. 0 if it is gone."""
    with contextlib.suppress(OSError):
        for line in Path(f"/proc/{pid}/smaps_rollup").read_text().splitlines():
            if line.startswith("Pss:"):
                return int(line.split()[1]) * 1024
    return 0


def pid_of(handle: int) -> int:
    """Return the process id, as this process sees it, behind a pidfd; -1 if it has been reaped."""
    for line in Path(f"/proc/self/fdinfo/{handle}").read_text().splitlines():
        if line.startswith("Pid:"):
            return int(line.split()[1])
    return -1
