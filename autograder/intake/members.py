"""The files in what was handed in, a folder or a zip, with zips inside taken for folders. No link is followed."""

from __future__ import annotations

import errno
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
"""More files than this are no student's work."""
_DEPTH = 32
"""Folders inside each other that are looked into."""
_ZIP_BYTES = 64 * 1024 * 1024
"""The largest zip inside another, in bytes; one student's repository."""
_ZIPS = 3
"""Zips inside each other that are looked into: a class in a folder's zip, a student's, and what they packed."""
_OF_SYSTEMS = ("__MACOSX", ".git", ".DS_Store")
"""Folders that a system or a program made, with nothing in them that somebody handed in."""


class TooManyError(Exception):
    """It holds more files than anybody's work."""


@dataclass(frozen=True)
class Member:
    """One file, or a link or something else that cannot be read as one."""

    path: tuple[str, ...]
    """From the source on; a zip inside is a folder of its name without `.zip`."""
    read: Callable[[int], bytes]
    """At most so many bytes of it. Raises OSError, or what a damaged zip raises."""

    @property
    def name(self) -> str:
        """The file's own name."""
        return self.path[-1]


def in_folder(source: Path, parts: tuple[str, ...]) -> Iterator[Member]:
    """Give the files of a folder, with those below it.

    Args:
        source: from which paths count.
        parts: the folder's path in it.

    Raises:
        OSError: the folder cannot be looked into. One below it is then a file that cannot be read.
    """
    for entry in sorted(os.scandir(source.joinpath(*parts)), key=lambda entry: entry.name):
        path = (*parts, entry.name)
        if is_unseen(entry.name):
            continue
        if entry.is_dir(follow_symlinks=False) and len(path) < _DEPTH:
            try:
                yield from in_folder(source, path)
            except OSError as error:
                yield Member(path, partial(_refuse, error))
        elif not entry.is_dir(follow_symlinks=False):
            yield Member(path, partial(read_plain, source, path))


def _refuse(error: OSError, most: int) -> bytes:
    raise OSError(error.errno or errno.EACCES, error.strerror)


def is_unseen(name: str) -> bool:
    """Whether a file or folder is none that somebody handed in: a system or a packer put it there."""
    return name in _OF_SYSTEMS or name.startswith("._")


def is_hidden(path: tuple[str, ...]) -> bool:
    """Whether a listing would not show it, or what it lies in, such as a checkpoint of JupyterLab's."""
    return any(part.startswith(".") for part in path)


def in_zip(archive: zipfile.ZipFile, bad: list[str], above: tuple[str, ...] = ()) -> Iterator[Member]:
    """Give the files of a zip, which stays open for as long as they are read.

    Args:
        archive: the zip.
        bad: gets the names that lead nowhere in it, or out of it.
        above: the folders that the zip counts as being in.
    """
    for info in archive.infolist():
        path = _path(info)
        if not path:
            bad.append(info.orig_filename)
        elif not info.is_dir() and not any(is_unseen(part) for part in path):
            yield Member((*above, *path), partial(_read, archive, info))


def empty_folders(archive: zipfile.ZipFile) -> Iterator[tuple[str, ...]]:
    """Give the paths of the folders that a zip names as such."""
    for info in archive.infolist():
        if (path := _path(info)) and info.is_dir():  # Python cannot say it of a name without characters
            yield path


def _path(info: zipfile.ZipInfo) -> tuple[str, ...]:
    """Where in a zip a member lies; empty if its name leads nowhere in it, or out of it."""
    path = PurePosixPath(_name(info).replace("\\", "/"))
    leads_out = path.is_absolute() or ".." in path.parts or "\0" in info.orig_filename
    return () if leads_out else path.parts


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


def looked_into(file: Member) -> list[Member]:
    """Return a file, or what it holds if it is a zip that can be read.

    Raises:
        TooManyError: it holds more than anybody's work.
    """
    return _inner(file, file, _ZIPS)


def unpacked(zipped: Member) -> list[Member]:
    """Return the files of a zip, and of zips in it that can be read, which count as folders.

    What a zip holds is read out of it anew for each file that is wanted: large zips do not fill the memory.

    Raises:
        OSError, zipfile.BadZipFile: or what else a damaged zip raises.
        TooManyError: it holds more than anybody's work.
    """
    return _held(zipped, zipped, _ZIPS)


def bad_names(zipped: Member) -> list[str]:
    """Return the names in a zip that lead nowhere in it; raises as `unpacked`."""
    bad: list[str] = []
    list(in_zip(_opened(zipped), bad))
    return bad


def packed_in(zipped: Member) -> list[Member]:
    """Return the files of a zip, among which other zips are files; raises as `unpacked`."""
    above = (*zipped.path[:-1], zipped.name[: -len(".zip")])
    files = enumerate(in_zip(_opened(zipped), [], above))
    return [Member(file.path, partial(_read_again, zipped, above, number)) for number, file in files]


def _held(zipped: Member, now: Member, depth: int) -> list[Member]:
    """The files of a zip, which is `now` in an archive that is open, and `zipped` when that is closed again."""
    above = (*zipped.path[:-1], zipped.name[: -len(".zip")])
    files: list[Member] = []
    for number, file in enumerate(in_zip(_opened(now), [], above)):
        later = Member(file.path, partial(_read_again, zipped, above, number))
        files += _inner(later, file, depth - 1)
        if len(files) > MOST:
            raise TooManyError(f"it holds more than {MOST} files")
    return files


def _inner(later: Member, now: Member, depth: int) -> list[Member]:
    """A file, or what it holds if it is a zip that can be read."""
    if not is_zip(now.name) or not depth:
        return [later]
    try:
        return _held(later, now, depth) or [later]
    except TooManyError:
        raise
    except Exception:  # a damaged zip raises many kinds; it is then a file as any other
        return [later]


def _read_again(zipped: Member, above: tuple[str, ...], number: int, most: int) -> bytes:
    """Read one file of a zip, known by its place: two may have one name."""
    for at, file in enumerate(in_zip(_opened(zipped), [], above)):
        if at == number:
            return file.read(most)
    raise OSError("it is not in the zip any more")


def _opened(member: Member) -> zipfile.ZipFile:
    content = member.read(_ZIP_BYTES + 1)
    if len(content) > _ZIP_BYTES:
        raise OSError(f"it is larger than {_ZIP_BYTES // 1024**2} MiB")
    return zipfile.ZipFile(io.BytesIO(content))
