"""Read the process list: the descendants of a process, its memory and its CPU time."""

from __future__ import annotations

import contextlib
import os
import threading
from dataclasses import dataclass

from autograder.core.errors import KitError

_OF_A_LAUNCH = 192
"""The number of threads that the programs of a launch may have together (`sandbox.limits`)."""


@dataclass(frozen=True)
class Process:
    """A process in the process list."""

    pid: int
    parent: int
    session: int
    threads: int


def read_text(path: str) -> str:
    """Return the text of a file in /proc, without the overhead of `pathlib` and `open`.

    This matters because a launch is inspected ten times a second.

    Raises:
        OSError: the file cannot be read, for example because the process has ended.
    """
    file = os.open(path, os.O_RDONLY | os.O_CLOEXEC)
    try:
        pieces = []
        while piece := os.read(file, 1 << 16):
            pieces.append(piece)
    finally:
        os.close(file)
    return b"".join(pieces).decode("utf-8", "replace")


def stat_fields(folder: str) -> list[str]:
    """Return the fields of the `stat` file of a process or thread (proc(5)), from the third field, the state, on.

    Raises:
        OSError: the process or thread has ended.
    """
    return read_text(f"{folder}/stat").rpartition(")")[2].split()


def threads(pid: int) -> list[int]:
    """Return the ids of a process's threads.

    Raises:
        OSError: the process has ended.
    """
    return [int(entry) for entry in os.listdir(f"/proc/{pid}/task")]


def no_threads(who: str) -> KitError | None:
    """Return an error if the machine allows fewer threads than a launch may have; None if it allows enough.

    Args:
        who: the program that could not go on, such as "`talker`".
    """
    if _can_start(_OF_A_LAUNCH):
        return None
    return KitError(
        f"This machine allows no more threads, so {who} could not go on.",
        "Close what else is running, such as other notebooks, or raise the limit: `ulimit -u`, or the container's.",
    )


def _can_start(count: int) -> bool:
    """Return whether this process can start `count` more threads now. To find out, start them.

    The limit may come from the user, the container or the system, and not every limit can be read.
    """
    over = threading.Event()
    before = threading.stack_size(256 * 1024)
    started = []
    try:
        for _ in range(count):
            thread = threading.Thread(target=over.wait, daemon=True)
            thread.start()
            started.append(thread)
    except RuntimeError:
        return False
    finally:
        threading.stack_size(before)
        over.set()
        for thread in started:
            thread.join()
    return True


def descendants(root: int) -> dict[int, Process]:
    """Return the living descendants of the process `root`. A process that cannot be read has just ended."""
    everyone: dict[int, list[str]] = {}
    children: dict[int, list[int]] = {}
    for entry in os.listdir("/proc"):
        if not entry.isdigit():
            continue
        with contextlib.suppress(OSError):
            fields = stat_fields(f"/proc/{entry}")
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
    """Return the bytes of memory, swapped out or not, that belong to no file; 0 if the process has ended.

    Shared mappings count in full, and so do pages that are still shared after a fork.
    """
    total = 0
    with contextlib.suppress(OSError):
        status = read_text(f"/proc/{pid}/status")
        for name in ("\nRssAnon:", "\nRssShmem:", "\nVmSwap:"):
            amount = status.partition(name)[2]
            if amount:
                total += int(amount.split(maxsplit=1)[0]) * 1024
    return total


def cpu_time(pid: int) -> float:
    """Return the seconds of CPU time of a process and of its children that have ended; 0 if the process has ended."""
    with contextlib.suppress(OSError):
        fields = stat_fields(f"/proc/{pid}")
        return sum(map(int, fields[11:15])) / os.sysconf("SC_CLK_TCK")
    return 0.0


def wants_cpu(pid: int) -> bool:
    """Return whether a thread of a process computes or waits for a CPU or a disk; False if the process has ended."""
    with contextlib.suppress(OSError):
        for thread in threads(pid):
            with contextlib.suppress(OSError, IndexError):
                if stat_fields(f"/proc/{pid}/task/{thread}")[0] in "RD":
                    return True
    return False


def pid_of(handle: int) -> int:
    """Return the id of the process that a pidfd refers to, as seen from this process; -1 if it has been reaped."""
    for line in read_text(f"/proc/self/fdinfo/{handle}").splitlines():
        if line.startswith("Pid:"):
            return int(line.split()[1])
    return -1
