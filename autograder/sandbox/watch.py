"""Holds the programs of a launch to what they may use together, which no limit of a single process does.

Memory, processes and disk have limits. CPU time has none, because how fast a program uses it depends on the machine as
well. One that computes on and on goes on, behind everyone else who wants to compute (`priority.py`).
"""

from __future__ import annotations

import contextlib
import os
import signal
from collections.abc import Sequence

from autograder.core.processes import Process, descendants, memory, proportional_memory
from autograder.sandbox.limits import Limits
from autograder.sandbox.running_program import RunningProgram


def enforce(first: int, base: int, programs: Sequence[RunningProgram], limits: Limits) -> bool:
    """Look at what a launch uses, and end the biggest of its programs if that is too much.

    Args:
        first: its first process; every other one descends from it, since orphans become its children.
        base: bytes of memory that the first process had before it started anything; forks share them.
        programs: those that run.
        limits: of all together.

    Returns:
        False if it is the first process itself that uses too much: then everything has to end.
    """
    family = descendants(first)
    own = memory(first) - base
    if own > limits.memory:
        return False
    if own + sum(max(0, memory(pid) - base) for pid in family) > limits.memory:
        sizes = {pid: proportional_memory(pid) for pid in family}
        if sum(sizes.values()) > limits.memory:
            _end_biggest(programs, family, sizes, "memory limit")
    if sum(process.threads for process in family.values()) >= limits.processes - 8:
        _end_biggest(programs, family, {pid: process.threads for pid, process in family.items()}, "process limit")
    return True


def _end_biggest(
    programs: Sequence[RunningProgram], family: dict[int, Process], sizes: dict[int, int], why: str
) -> None:
    """End the program whose processes use most, and all processes that belong to no program any more."""
    owned: dict[int, list[int]] = {}
    roots = {program.pid for program in programs}
    for pid in family:
        owner = pid
        while owner in family and owner not in roots:
            owner = family[owner].session if family[owner].session in roots else family[owner].parent
        owned.setdefault(owner if owner in roots else 0, []).append(pid)
    ending = owned.pop(0, [])
    if owned:
        worst = max(owned, key=lambda owner: sum(sizes[pid] for pid in owned[owner]))
        ending += owned[worst]
        next(program for program in programs if program.pid == worst)._kill(why)
    for pid in ending:
        with contextlib.suppress(ProcessLookupError, PermissionError):
            os.kill(pid, signal.SIGKILL)
