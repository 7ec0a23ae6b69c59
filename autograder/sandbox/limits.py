"""What a student's programs may use."""

from __future__ import annotations

from dataclasses import dataclass

MIB = 1024 * 1024


@dataclass(frozen=True)
class Limits:
    """Limits of a launch. Sizes are in bytes, times in seconds."""

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
    cpu_seconds: int = 10
    """Of one process. A whole node takes a third of a second."""
    cpu_together: int = 100
    """Of all launches of a submission: what it has left when that is used up is `cpu_last`."""
    cpu_last: int = 2
    wall_seconds: float = 180.0
    """Of one program."""
    output_kept: int = 256 * 1024
    """How much of a program's output is kept: the first half and the last half of it."""
    output_bytes: int = 1 * MIB
    """A program that writes more is ended. A flood gets here before a check is over on a crowded machine, too."""
    events: int = 2000
    """How many lines of the probe are kept."""
