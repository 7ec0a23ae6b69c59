"""The files in what was handed in, a folder or a zip, with zips inside taken for folders. No link is followed."""

from __future__ import annotations

import io
import os
import stat
import zipfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

from autograder.core.files import read_plain

_MOST = 20_000
"""More files than this are no class."""
_DEPTH = 8
"""Folders that lie inside each other; a wrapper, a repository and its folders are five."""
_ZIP_BYTES = 64 * 1024 * 1024
"""The largest zip inside another, in bytes; one student's repository."""
_PACKERS = (".", "__MACOSX")
"""What the names of folders and files begin with that a system or a packer made."""


@dataclass(frozen=True)
class Member:
    """One file."""

    path: tuple[str, ...]
    """From the source on; a zip inside is a folder of its name without `.zip`."""
    read: Callable[[int], bytes]
    """At most so many bytes of it. Raises OSError, or what a damaged zip raises."""

    @property
    def name(self) -> str:
        """The file's own name."""
        return self.path[-1]


def members(source: Path) -> list[Member]:
    """Return the files of a folder or zip; what cannot be read or looked into is left out.

    Raises:
        zipfile.BadZipFile: the source is a zip that cannot be read, or one of those errors that zipfile has besides.
    """
    found: list[Member] = []
    listing = _of_folder(source, ()) if source.is_dir() else _of_zip(zipfile.ZipFile(source), ())
    for member in listing:
        if len(found) >= _MOST:
            break
        inside = list(_inside(member)) if member.name.lower().endswith(".zip") else []
        found += inside or [member]
    return found[:_MOST]


def _of_folder(source: Path, parts: tuple[str, ...]) -> Iterator[Member]:
    folder = source.joinpath(*parts)
    try:
        entries = sorted(os.scandir(folder), key=lambda entry: entry.name)
    except OSError:
        return
    for entry in entries:
        path = (*parts, entry.name)
        if entry.name.startswith(_PACKERS):
            continue
        if entry.is_dir(follow_symlinks=False):
            if len(path) < _DEPTH:
                yield from _of_folder(source, path)
        elif entry.is_file(follow_symlinks=False):
            yield Member(path, lambda most, path=path: read_plain(source, path, most))  # type: ignore[misc]


def _of_zip(archive: zipfile.ZipFile, parts: tuple[str, ...]) -> Iterator[Member]:
    for info in archive.infolist()[:_MOST]:
        path = PurePosixPath(member_name(info).replace("\\", "/"))
        plain = stat.S_IFMT(info.external_attr >> 16) in (0, stat.S_IFREG) and not info.is_dir()
        if not plain or not path.parts or path.is_absolute() or ".." in path.parts or "\0" in info.orig_filename:
            continue
        if len(path.parts) <= _DEPTH and not any(part.startswith(_PACKERS) for part in path.parts):
            yield Member((*parts, *path.parts), lambda most, info=info: _read(archive, info, most))  # type: ignore[misc]


def _read(archive: zipfile.ZipFile, info: zipfile.ZipInfo, most: int) -> bytes:
    with archive.open(info) as file:
        return file.read(most)


def member_name(info: zipfile.ZipInfo) -> str:
    """A member's name; some packers write UTF-8 without saying so, which then is taken for the DOS character set."""
    if not info.flag_bits & 0x800:
        try:
            return info.filename.encode("cp437").decode("utf-8")
        except UnicodeError:
            pass
    return info.filename


def _inside(member: Member) -> Iterator[Member]:
    """The files of a zip inside; none if it is no zip, or too large."""
    try:
        content = member.read(_ZIP_BYTES + 1)
        if len(content) <= _ZIP_BYTES:
            yield from _of_zip(zipfile.ZipFile(io.BytesIO(content)), (*member.path[:-1], member.name[:-4]))
    except Exception:  # a damaged zip raises many kinds; it is then a file as any other
        return
