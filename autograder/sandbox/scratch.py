"""A temporary folder of one process, which is removed when the process ends, or soon afterwards."""

from __future__ import annotations

import contextlib
import fcntl
import os
import shutil
import tempfile
from pathlib import Path

_PREFIX = "autograder-run-"


class Scratch:
    """An empty folder. A lock shows that its process is alive.

    Every new scratch folder first removes the folders of processes that are no longer alive.
    """

    def __init__(self) -> None:
        """Create the folder."""
        for old in Path(tempfile.gettempdir()).glob(f"{_PREFIX}*"):
            with contextlib.suppress(OSError):
                held = os.open(old, os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW | os.O_CLOEXEC)
                try:
                    fcntl.flock(held, fcntl.LOCK_EX | fcntl.LOCK_NB)
                    shutil.rmtree(old, ignore_errors=True)
                finally:
                    os.close(held)
        self.folder = Path()
        while not self.folder.name:  # another process may remove a new folder as abandoned before it is locked
            made = Path(tempfile.mkdtemp(prefix=_PREFIX))
            try:
                self._held = os.open(made, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
            except FileNotFoundError:
                continue
            fcntl.flock(self._held, fcntl.LOCK_EX)
            if made.is_dir():
                self.folder = made
            else:
                os.close(self._held)

    def remove(self) -> None:
        """Remove the folder and everything in it. This can be called twice."""
        if self._held >= 0:
            shutil.rmtree(self.folder, ignore_errors=True)
            os.close(self._held)
            self._held = -1

    def __enter__(self) -> Path:
        """Return the folder."""
        return self.folder

    def __exit__(self, *_: object) -> None:
        """Remove the folder."""
        self.remove()
