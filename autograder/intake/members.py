"""The files in what was handed in, a folder or a zip, with zips inside taken for folders. No link is followed."""

from __future__ import annotations

import io
import os
import stat
import zipfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path, PurePosixPath

from autograder.core.files import read_plain

MOST = 20_000
"""More files than this are no class."""
_DEPTH = 8
"""Folders inside each other that are looked into; a wrapper, a repository and its folders are five."""
_ZIP_BYTES = 64 * 1024 * 1024
"""The largest zip inside another, in bytes; one student's repository."""
PACKERS = (".", "__MACOSX")
"""What the names of folders and files begin with that a system or a packer made."""


@dataclass(frozen=True)
class Member:
    """One file."""

    path: tuple[str, ...]
    """From the source on; a zip inside is a folder of its name without `.zip`."""
    read: Callable[[int], bytes]
    """At most so many bytes of it. Raises OSError, or what a damaged zip raises."""
    zip: str = ""
    """The name, without `.zip`, of the zip inside the source that it lies in; empty if it lies in none."""

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
    listing = _of_folder(source, ()) if source.is_dir() else in_zip(zipfile.ZipFile(source), [])
    for member in listing:
        if len(found) >= MOST:
            break
        inside = unpacked(member) if is_zip(member.name) else []
        found += inside or [member]
    return found[:MOST]


def _of_folder(source: Path, parts: tuple[str, ...]) -> Iterator[Member]:
    folder = source.joinpath(*parts)
    try:
        entries = sorted(os.scandir(folder), key=lambda entry: entry.name)
    except OSError:
        return
    for entry in entries:
        path = (*parts, entry.name)
        if entry.name.startswith(PACKERS):
            continue
        if entry.is_dir(follow_symlinks=False):
            if len(path) < _DEPTH:
                yield from _of_folder(source, path)
        elif entry.is_file(follow_symlinks=False):
            yield Member(path, lambda most, path=path: read_plain(source, path, most))  # type: ignore[misc]


def in_zip(archive: zipfile.ZipFile, bad: list[str], above: tuple[str, ...] = ()) -> Iterator[Member]:
    """Give the files of a zip, which stays open for as long as they are read.

    Args:
        archive: the zip.
        bad: gets the names that lead nowhere in it, or out of it.
        above: the folders that the zip counts as being in.
    """
    for info in archive.infolist()[:MOST]:
        path = PurePosixPath(_name(info).replace("\\", "/"))
        if not path.parts or path.is_absolute() or ".." in path.parts or "\0" in info.orig_filename:
            bad.append(info.orig_filename)
        elif not info.is_dir() and not any(part.startswith(PACKERS) for part in path.parts):
            yield Member((*above, *path.parts), lambda most, info=info: _read(archive, info, most))  # type: ignore[misc]


def _read(archive: zipfile.ZipFile, info: zipfile.ZipInfo, most: int) -> bytes:
    if stat.S_IFMT(info.external_attr >> 16) not in (0, stat.S_IFREG):
        raise OSError("it is a link or something else that is no file")
    with archive.open(info) as file:
        return file.read(most)


def _name(info: zipfile.ZipInfo) -> str:
    """A member's name; some packers write UTF-8 without saying so, which then is taken for the DOS character set."""
    if not info.flag_bits & 0x800:
        try:
            return info.filename.encode("cp437").decode("utf-8")
        except UnicodeError:
            pass
    return info.filename


def is_zip(name: str) -> bool:
    """Whether a file is a zip by its name."""
    return name.lower().endswith(".zip")


def unpacked(member: Member) -> list[Member]:
    """Return the files of a zip inside; none if it is no zip, or too large."""
    try:
        content = member.read(_ZIP_BYTES + 1)
        if len(content) > _ZIP_BYTES:
            return []
        name = member.name[: -len(".zip")]
        files = in_zip(zipfile.ZipFile(io.BytesIO(content)), [], (*member.path[:-1], name))
        return [replace(file, zip=name) for file in files]
    except Exception:  # a damaged zip raises many kinds; it is then a file as any other
        return []
