"""Make copies of a gradebook before its cells or tables are changed."""

from __future__ import annotations

import contextlib
import os
import sqlite3
import time
from pathlib import Path

BACKUPS = "backups"
"""The name of the folder for the copies. It is in the same folder as the gradebook."""


def file_of(address: str) -> Path | None:
    """Return the file at a gradebook's address; None if the gradebook is on a server."""
    scheme, _, path = address.partition(":///")
    return Path(path) if scheme == "sqlite" else None


def back_up(address: str, reason: str) -> Path | None:
    """Copy a gradebook and return the path of the copy; None if there is no file to copy.

    A gradebook on a server is not copied, because its administrator makes backups.

    Args:
        address: the gradebook's address in the form that SQLAlchemy expects.
        reason: the reason for the copy, in a few words that are allowed in a file name.
    """
    file = file_of(address)
    if file is None or not file.exists():
        return None
    now = time.time_ns()
    second = time.strftime("%Y-%m-%d_%H-%M-%S", time.localtime(now // 10**9))
    moment = f"{second}.{now // 1000 % 10**6:06d}"  # unique, and sorted after the names of earlier copies
    copy = file.parent / BACKUPS / f"{moment}_{reason.replace(' ', '_')}.db"
    copy.parent.mkdir(exist_ok=True)
    beside = copy.with_name(f".{copy.name}.{os.getpid()}")
    try:
        # SQLite makes the copy, so that a change by another process is in it completely or not at all.
        with contextlib.closing(sqlite3.connect(file)) as source, contextlib.closing(sqlite3.connect(beside)) as target:
            source.backup(target)
        beside.replace(copy)
    finally:
        beside.unlink(missing_ok=True)
    return copy
