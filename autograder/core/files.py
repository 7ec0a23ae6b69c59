"""Write files completely or not at all, and read other people's files safely, without following links."""

from __future__ import annotations

import contextlib
import errno
import fcntl
import os
import re
import stat
import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

from autograder.core.errors import KitError


def write_beside(path: Path, content: str | bytes) -> None:
    """Write a file under a temporary name and then rename it, so that no reader ever sees half of it.

    Raises:
        OSError: the file cannot be written; `filename` is its path.
    """
    beside = path.with_name(f".{path.name}.{os.getpid()}")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        beside.write_bytes(content.encode("utf-8") if isinstance(content, str) else content)
        beside.replace(path)
    except OSError as error:
        with contextlib.suppress(OSError):
            beside.unlink()
        error.filename = str(path)  # otherwise the error names the temporary file, or none if the disk is full
        raise


_BESIDE = re.compile(r"\..+\.(\d+)")
"""The temporary name of a file in `write_beside`, with the id of the process that writes it."""


def remove_unfinished(folder: Path) -> None:
    """Remove temporary files of `write_beside` below a folder if the process that wrote them was killed."""
    for path in folder.rglob(".*"):
        found = _BESIDE.fullmatch(path.name)
        if found and path.is_file() and not Path("/proc", found[1]).exists():
            path.unlink(missing_ok=True)


def signature(path: Path) -> tuple[int, ...] | None:
    """Return a value that changes when the file changes; None if there is no file. Links are not followed."""
    try:
        state = path.lstat()
    except OSError:
        return None
    return state.st_dev, state.st_ino, state.st_size, state.st_mtime_ns, state.st_ctime_ns


def read_plain(folder: Path, parts: Sequence[str], most: int) -> bytes:
    """Read a regular file that somebody else put below a folder, without following any link.

    Args:
        folder: the folder to start from. Its own path may contain links.
        parts: the names of the folders below it, and of the file.
        most: the largest number of bytes to read.

    Raises:
        OSError: the file cannot be read, or a part of the path is a link or has the wrong kind. `strerror` gives the
            reason in words for a person.
    """
    passing = os.O_PATH | os.O_DIRECTORY  # works also if the folder can be entered but not listed
    here = os.open(folder, passing)
    try:
        for number, part in enumerate(parts, start=1):
            last = number == len(parts)
            # The kind is checked before opening, because opening a device may already have an effect. O_NOFOLLOW and
            # the second check are needed because the name may have been given to something else in the meantime, and
            # O_NONBLOCK because opening a FIFO would wait for its writer.
            _refuse_kind(part, os.stat(part, dir_fd=here, follow_symlinks=False).st_mode, last)
            how = os.O_RDONLY | os.O_NONBLOCK if last else passing
            there = os.open(part, how | os.O_NOFOLLOW, dir_fd=here)
            os.close(here)
            here = there
            _refuse_kind(part, os.fstat(here).st_mode, last)
        with os.fdopen(here, "rb", closefd=False) as file:
            return file.read(most)
    finally:
        os.close(here)


_KINDS: dict[str, Callable[[int], bool]] = {
    "a link": stat.S_ISLNK,
    "a folder": stat.S_ISDIR,
    "a file": stat.S_ISREG,
    "a FIFO": stat.S_ISFIFO,
    "a socket": stat.S_ISSOCK,
    "a device": lambda mode: stat.S_ISCHR(mode) or stat.S_ISBLK(mode),
}


def _refuse_kind(name: str, mode: int, last: bool) -> None:
    wanted = stat.S_ISREG if last else stat.S_ISDIR
    if wanted(mode):
        return
    kind = next((word for word, test in _KINDS.items() if test(mode)), "something else")
    what = "file" if last else "folder"
    more = "; links are not followed" if stat.S_ISLNK(mode) else ""
    raise OSError(errno.EINVAL, f"{name[:60]!r} is {kind}, not a {what}{more}")


@contextlib.contextmanager
def only_one(path: Path, what: str) -> Iterator[None]:
    """Hold a lock file while the block runs.

    Args:
        path: the lock file; its folder is created.
        what: the activity that needs the lock, as the subject of a sentence.

    Raises:
        KitError: another process holds the lock.
        OSError: the lock file cannot be written; `filename` is its path.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    # O_CLOEXEC: a child process that outlives this one must not keep the lock. Two graders whose umask allows it may
    # both write the file.
    with os.fdopen(os.open(path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o666), "r+") as file:
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
            error.filename = str(path)  # if the disk is full, the error names no file
            raise
        yield
