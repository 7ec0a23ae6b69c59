"""Gives a process tree its own /tmp, /dev/shm and /proc, in its own mount namespace."""

import os
import re

from .kernel import (
    MS_BIND,
    MS_NODEV,
    MS_NOEXEC,
    MS_NOSUID,
    MS_PRIVATE,
    MS_RDONLY,
    MS_REC,
    MS_REMOUNT,
    checked,
    libc,
)


def make(disk: int, inodes: int) -> None:
    """Mount an empty /tmp and /dev/shm, and a /proc that shows only this PID namespace.

    Args:
        disk: the size in bytes of /tmp and of /dev/shm.
        inodes: the largest number of files and folders in each of these two; 0 for no limit.

    Raises:
        OSError: the kernel refuses.
    """
    checked(libc.mount(None, b"/", None, MS_REC | MS_PRIVATE, None))
    options = f"size={disk},nr_inodes={inodes},mode=1777".encode()
    python = _python_below("/tmp")
    for place in (b"/tmp", b"/dev/shm"):
        checked(libc.mount(b"tmpfs", place, b"tmpfs", MS_NOSUID | MS_NODEV, options))
    _put_back(*python)
    checked(libc.mount(b"proc", b"/proc", b"proc", MS_NOSUID | MS_NODEV | MS_NOEXEC, None))


def close_settings() -> None:
    """Make the kernel's settings read-only, because programs could change those that belong to their namespaces.

    After that, no nested namespace can mount its own /proc.

    Raises:
        OSError: the kernel refuses.
    """
    checked(libc.mount(b"/proc/sys", b"/proc/sys", None, MS_BIND, None))
    read_only = MS_BIND | MS_REMOUNT | MS_RDONLY | MS_NOSUID | MS_NODEV | MS_NOEXEC
    checked(libc.mount(None, b"/proc/sys", None, read_only, None))


def _python_below(place: str) -> tuple[list[str], list[tuple[str, str]], list[tuple[str, bool, int]]]:
    """Return the folders, links and mounts below a place.

    They have to be restored if the virtual environment itself is below this place, so that Python stays available.
    """
    with open("/proc/self/mountinfo", encoding="utf-8", errors="surrogateescape") as table:
        lines = [line.split(" ")[4] for line in table]
    mounts = {re.sub(r"\\([0-7]{3})", lambda code: chr(int(code[1], 8)), line) for line in lines}
    folders: list[str] = []
    links: list[tuple[str, str]] = []
    held: list[tuple[str, bool, int]] = []
    waiting = [place]
    while waiting:
        for entry in os.scandir(waiting.pop()):
            if entry.path in mounts:
                held.append((entry.path, entry.is_dir(), os.open(entry.path, os.O_PATH | os.O_CLOEXEC)))
            elif entry.is_symlink():
                links.append((os.readlink(entry.path), entry.path))
            elif entry.is_dir():
                folders.append(entry.path)
                waiting.append(entry.path)
    return folders, links, held


def _put_back(folders: list[str], links: list[tuple[str, str]], held: list[tuple[str, bool, int]]) -> None:
    """Restore the folders, links and mounts that `_python_below` found, read-only as they were."""
    for folder in folders:
        os.mkdir(folder, 0o755)
    for target, link in links:
        os.symlink(target, link)
    for path, is_folder, handle in held:
        if is_folder:
            os.mkdir(path, 0o755)
        else:
            os.close(os.open(path, os.O_CREAT | os.O_WRONLY | os.O_CLOEXEC, 0o644))
        where = os.fsencode(path)
        checked(libc.mount(f"/proc/self/fd/{handle}".encode(), where, None, MS_BIND | MS_REC, None))
        os.close(handle)
        if not os.statvfs(path).f_flag & os.ST_RDONLY:
            flags = MS_BIND | MS_REMOUNT | MS_RDONLY | MS_NOSUID | MS_NODEV
            checked(libc.mount(None, where, None, flags, None))
