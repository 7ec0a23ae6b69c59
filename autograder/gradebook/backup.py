"""Copies of a gradebook, made before what is in it changes its form."""

from __future__ import annotations

import contextlib
import os
import sqlite3
import time
from pathlib import Path

BACKUPS = "backups"
"""The folder of copies, beside the gradebook."""


def file_of(address: str) -> Path | None:
    """Return the file at a gradebook's address; None where it is a server's."""
    scheme, _, path = address.partition(":///")
    return Path(path) if scheme == "sqlite" else None


def back_up(address: str, reason: str) -> Path | None:
    """Copy a gradebook, and return the copy; None where it lies on a server, whose keeper makes the copies.

    Args:
        address: as SQLAlchemy wants it.
        reason: of the copy, a word or two that a file name may hold.
    """
    file = file_of(address)
    if file is None or not file.exists():
        return None
    now = time.time_ns()
    second = time.strftime("%Y-%m-%d_%H-%M-%S", time.localtime(now // 10**9))
    moment = f"{second}.{now // 1000 % 10**6:06d}"  # never that of another, and later than those before it
    copy = file.parent / BACKUPS / f"{moment}_{reason.replace(' ', '_')}.db"
    copy.parent.mkdir(exist_ok=True)
    beside = copy.with_name(f".{copy.name}.{os.getpid()}")
    try:
        # Not as a file: a change that another process is about to make must be in it whole or not at all.
        with contextlib.closing(sqlite3.connect(file)) as source, contextlib.closing(sqlite3.connect(beside)) as target:
            source.backup(target)
        beside.replace(copy)
    finally:
        beside.unlink(missing_ok=True)
    return copy
