"""Notes what a program does with rclpy, as JSON lines: for hints only, never for points; a program can forge them.

It runs inside the student's process and must never change what the program does, or end it.
"""

import json
import os
from typing import Any

_fd = -1


def prepare() -> None:
    """Do once, in the launcher, what every program would otherwise do again."""


def install(fd: int, folder: str) -> None:
    """Begin to write to `fd`."""
    global _fd
    _fd = fd


def emit(event: dict[str, Any]) -> None:
    """Write one event, or drop it: a full pipe must not hold up the program."""
    try:
        os.write(_fd, json.dumps(event).encode()[:4000] + b"\n")
    except Exception:
        return
