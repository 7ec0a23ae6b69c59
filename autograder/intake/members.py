"""The files in what was handed in, a folder or a zip, with zips inside taken for folders. No link is followed."""

from __future__ import annotations

import io
import os
import stat
import zipfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path, PurePosixPath

from autograder.core.files import read_plain

MOST = 20_000
"""More files than this are no class."""
_DEPTH = 8
"""Folders inside each other that are looked into; a wrapper, a repository and its folders are five."""
_ZIP_BYTES = 64 * 1024 * 1024
"""The largest zip inside another, in bytes; one student's repository."""
_ZIPS = 3
"""Zips inside each other that are looked into: a class in a folder's zip, a student's, and what they packed."""
PACKERS = (".", "__MACOSX")
"""What the names of folders and files begin with that a system or a packer made."""


@dataclass(frozen=True)
class Member:
    """One file."""

    path: tuple[str, ...]
    """From the source on; a zip inside is a folder of its name without `.zip`."""
    read: Callable[[int], bytes]
    """At most so many bytes of it. Raises OSError, or what a damaged zip raises."""
    zips: tuple[str, ...] = ()
    """The names, without `.zip`, of the zips inside the source that it lies in, the outermost first."""

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
    listing = in_folder(source, ()) if source.is_dir() else in_zip(zipfile.ZipFile(source), [])
    for member in listing:
        if len(found) >= MOST:
            break
        found += unpacked(member) or [member]
    return found[:MOST]


def in_folder(source: Path, parts: tuple[str, ...]) -> Iterator[Member]:
    """Give the files of a folder, with those below it.

    Args:
        source: from which paths count.
        parts: the folder's path in it.
    """
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
                yield from in_folder(source, path)
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


def is_notebook(name: str) -> bool:
    """Whether a file is a notebook by its name."""
    return name.lower().endswith(".ipynb")


def unpacked(member: Member) -> list[Member]:
    """Return the files of a zip inside, and of zips in that; none if it is no zip, or too large.

    What a zip holds is read out of it anew for each file that is wanted: large zips do not fill the memory.
    """
    return _held(member, member, _ZIPS)


def _held(zipped: Member, now: Member, depth: int) -> list[Member]:
    """The files of a zip, which is `now` in an archive that is open, and `zipped` when that is closed again."""
    if not is_zip(zipped.name) or not depth:
        return []
    name = zipped.name[: -len(".zip")]
    above = (*zipped.path[:-1], name)

    def read_again(path: tuple[str, ...], most: int) -> bytes:
        return next(again for again in in_zip(_opened(zipped), [], above) if again.path == path).read(most)

    files: list[Member] = []
    try:
        for file in in_zip(_opened(now), [], above):
            later = Member(file.path, partial(read_again, file.path), (*zipped.zips, name))
            files += _held(later, file, depth - 1) or [later]
            if len(files) >= MOST:
                break
    except Exception:  # a damaged zip raises many kinds; it is then a file as any other
        return []
    return files[:MOST]


def _opened(member: Member) -> zipfile.ZipFile:
    content = member.read(_ZIP_BYTES + 1)
    if len(content) > _ZIP_BYTES:
        raise OSError("it is too large")
    return zipfile.ZipFile(io.BytesIO(content))
