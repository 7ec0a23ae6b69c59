"""A lock that one process at a time holds, and that goes with it, however it ends."""

from __future__ import annotations

import contextlib
import fcntl
import os
import time
from collections.abc import Iterator
from pathlib import Path

from autograder.core.errors import KitError


@contextlib.contextmanager
def only_one(path: Path, what: str) -> Iterator[None]:
    """Hold the lock of a file as long as the block runs.

    Args:
        path: of the lock; its folder is made.
        what: holds it, as the subject of a sentence.

    Raises:
        KitError: another process holds it.
        OSError: it cannot be written; its `filename` says which.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    # Inherited by nothing: a child that lives on must not keep the lock.
    with os.fdopen(os.open(path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o644), "r+") as file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError as error:
            who = file.read(200).strip() or "another process"
            raise KitError(
                f"{what} is at work in {path.parent.parent} already: {who}.",
                "Wait until it has ended, or end it with Ctrl-C, then start again: what is finished is kept.",
            ) from error
        try:
            os.ftruncate(file.fileno(), 0)
            os.write(file.fileno(), f"process {os.getpid()}, since {time.strftime('%H:%M:%S')}".encode())
        except OSError as error:
            error.filename = str(path)  # a full disk names no file
            raise
        yield
