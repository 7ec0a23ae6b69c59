"""The limits of what a student's programs may use.

No limit depends on the machine. How long a program runs, how much it computes and how much it prints depends on how
fast the machine is and on what else it does. Therefore none of these ends a program: it runs until the end of its
launch. A program that computes all the time gets a low priority (`running_program.py`), and one that prints without end
is read no faster than a terminal would read it (`running_programs.py`).
"""

from __future__ import annotations

from dataclasses import dataclass

MIB = 1024 * 1024


@dataclass(frozen=True)
class Limits:
    """The limits of a launch. Sizes are in bytes."""

    memory: int = 512 * MIB
    """The sum, over all processes, of the memory that they have beyond what the launcher had loaded. Memory that a
    program shares with processes which it starts itself counts for each of them."""
    address_space: int = 2048 * MIB
    """The limit of one process. A node's threads alone reserve 0.4 GiB."""
    processes: int = 192
    """The processes and threads of all programs together; a node has about 12."""
    open_files: int = 256
    signals: int = 1024
    """The pending signals and timers of all programs together."""
    file_size: int = 16 * MIB
    disk: int = 16 * MIB
    """The size of all files in /tmp, and the same for /dev/shm."""
    inodes: int = 1024
    """The number of files and folders in each of these. Even an empty file costs the kernel a kilobyte of memory, which
    no other limit counts."""
    output_kept: int = 256 * 1024
    """The bytes of a program's output that are kept: one half from its beginning, and one half from its end."""
    events: int = 2000
    """The number of the probe's lines that are kept."""
