"""What a student's programs may use.

Nothing here is a statement about the machine. How long a program runs, how much it computes and how much it prints
depends on how fast that is and on what else it does, so none of these ends a program: it runs until the end of its
launch. One that computes on and on gives way to others (`running_program.py`), and one that prints without end is read
no faster than a terminal would (`running_programs.py`).
"""

from __future__ import annotations

from dataclasses import dataclass

MIB = 1024 * 1024


@dataclass(frozen=True)
class Limits:
    """Limits of a launch. Sizes are in bytes."""

    memory: int = 512 * MIB
    """Sum over all programs of what they do not share with each other."""
    address_space: int = 2048 * MIB
    """Of one process. A node's threads alone reserve 0.4 GiB."""
    processes: int = 192
    """Processes and threads of all programs together; a node has about 12."""
    open_files: int = 256
    signals: int = 1024
    """Waiting signals and timers of all programs together."""
    file_size: int = 16 * MIB
    disk: int = 16 * MIB
    """What may lie in /tmp, and again in /dev/shm."""
    inodes: int = 1024
    """Files and folders there, again in each: an empty file costs the kernel a kilobyte that no limit counts."""
    output_kept: int = 256 * 1024
    """How much of a program's output is kept: the first half and the last half of it."""
    events: int = 2000
    """How many lines of the probe are kept."""
