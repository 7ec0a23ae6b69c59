"""List and read the files in a folder or zip. Zips inside it count as folders, and links are not followed."""

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
"""The number of files that the work of a student can have."""
_DEPTH = 32
"""The deepest nesting of folders that is read."""
_ZIP_BYTES = 64 * 1024 * 1024
"""The size of the largest zip inside another, in bytes. Such a zip is the repository of one student."""
_BYTES, _ENTRIES = 4 * _ZIP_BYTES, 5 * MOST
"""The bytes and the entries, folders included, that all zips of one student may have together while they are listed."""
_ENTRY = b"PK\x01\x02"
"""How each entry begins in the directory of a zip."""
_ZIPS = 3
"""The deepest nesting of zips that is read: the zip of a class, that of a student, and one that the student packed."""
_OF_SYSTEMS = ("__MACOSX", ".git", ".DS_Store")
"""Names that an operating system or a program creates, and that contain nothing that a student handed in."""


class TooManyError(Exception):
    """A folder or zip has more files than the work of a student can have."""


@dataclass
class Budget:
    """What the zips of one student may still take. Zips in zips could otherwise take days: each level multiplies."""

    size: int = _BYTES
    entries: int = _ENTRIES

    def take(self, content: bytes) -> None:
        """Take what a zip needs, before its directory is read.

        Raises:
            TooManyError: so much is not left.
        """
        self.size -= len(content)
        self.entries -= content.count(_ENTRY)
        if self.size < 0 or self.entries < 0:
            raise TooManyError(
                f"the zips in it have more than {_BYTES // 1024**2} MiB, or more than {_ENTRIES} files and folders"
            )


@dataclass(frozen=True)
class Member:
    """A file, or a link or something else that cannot be read like a file."""

    path: tuple[str, ...]
    """The path in the source. A zip in it counts as a folder with the zip's name without `.zip`."""
    read: Callable[[int], bytes]
    """A function that reads at most so many bytes. It raises OSError, or the errors of a damaged zip."""

    @property
    def name(self) -> str:
        """The file's own name, without its folders."""
        return self.path[-1]


def in_folder(source: Path, parts: tuple[str, ...]) -> Iterator[Member]:
    """Yield the files of a folder and of the folders below it.

    A folder below it that cannot be read is yielded as a file that cannot be read.

    Args:
        source: the folder to which the paths are relative.
        parts: the path of the folder in the source.

    Raises:
        OSError: the folder itself cannot be read.
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
    """Return whether an operating system or a packing program added this file or folder, and not the student."""
    return name in _OF_SYSTEMS or name.startswith("._")


def is_hidden(path: tuple[str, ...]) -> bool:
    """Return whether a file or one of its folders is hidden, such as a checkpoint of JupyterLab."""
    return any(part.startswith(".") for part in path)


def in_zip(archive: zipfile.ZipFile, bad: list[str], above: tuple[str, ...] = ()) -> Iterator[Member]:
    """Yield the files of a zip, which must stay open while they are read.

    Args:
        archive: the zip.
        bad: a list to which names are added that are no valid paths in the zip or that lead out of it.
        above: the path of the folder that the zip counts as.
    """
    for info in archive.infolist():
        path = _path(info)
        if not path:
            bad.append(info.orig_filename)
        elif not info.is_dir() and not any(is_unseen(part) for part in path):
            yield Member((*above, *path), partial(_read, archive, info))


def empty_folders(archive: zipfile.ZipFile) -> Iterator[tuple[str, ...]]:
    """Yield the paths of the folders that a zip lists."""
    for info in archive.infolist():
        if (path := _path(info)) and info.is_dir():  # the path is checked first: `is_dir` fails if the name is empty
            yield path


def _path(info: zipfile.ZipInfo) -> tuple[str, ...]:
    """Return the path of a member in a zip; empty if its name is no valid path or leads out of the zip."""
    path = PurePosixPath(_name(info).replace("\\", "/"))
    leads_out = path.is_absolute() or ".." in path.parts or "\0" in info.orig_filename
    return () if leads_out else path.parts


def _read(archive: zipfile.ZipFile, info: zipfile.ZipInfo, most: int) -> bytes:
    if stat.S_IFMT(info.external_attr >> 16) not in (0, stat.S_IFREG):
        raise OSError("it is a link or something else, not a file")
    with archive.open(info) as file:
        return file.read(most)


def _name(info: zipfile.ZipInfo) -> str:
    """Return the name of a member.

    Some programs write names in UTF-8 without marking them, and Python then decodes them in the DOS character set.
    """
    if not info.flag_bits & 0x800:
        try:
            return info.filename.encode("cp437").decode("utf-8")
        except UnicodeError:
            pass
    return info.filename


def is_zip(name: str) -> bool:
    """Return whether a file is a zip, according to its name."""
    return name.lower().endswith(".zip")


def is_notebook(name: str) -> bool:
    """Return whether a file is a notebook, according to its name."""
    return name.lower().endswith(".ipynb")


def looked_into(file: Member, budget: Budget) -> list[Member]:
    """Return a file, or the files in it if it is a zip that can be read.

    Args:
        file: of a student.
        budget: what the zips of this student may take.

    Raises:
        TooManyError: the zip has more files than the work of a student can have.
    """
    return _inner(file, file, _ZIPS, budget)


def unpacked(zipped: Member) -> list[Member]:
    """Return the files of a zip. Zips in it that can be read count as folders.

    The zip is opened again for each file that is read, so that large zips do not fill the memory.

    Raises:
        OSError, zipfile.BadZipFile: the zip cannot be read. A damaged zip may also raise other errors.
        TooManyError: the zip has more files than the work of a student can have.
    """
    return _held(zipped, zipped, _ZIPS, Budget())


def bad_names(zipped: Member) -> list[str]:
    """Return the names in a zip that are no valid paths in it. It raises the same errors as `unpacked`."""
    bad: list[str] = []
    list(in_zip(_opened(zipped), bad))
    return bad


def packed_in(zipped: Member) -> list[Member]:
    """Return the files of a zip, where zips inside it count as files. It raises the same errors as `unpacked`."""
    above = (*zipped.path[:-1], zipped.name[: -len(".zip")])
    files = enumerate(in_zip(_opened(zipped), [], above))
    return [Member(file.path, partial(_read_again, zipped, above, number)) for number, file in files]


def _held(zipped: Member, now: Member, depth: int, budget: Budget) -> list[Member]:
    """Return the files of a zip and of the zips in it.

    Args:
        zipped: the zip as it is read later, when the archive around it is closed.
        now: the same zip as it is read now, while the archive around it is open.
        depth: how many levels of zips may be read.
        budget: what all zips around and in it may take.
    """
    above = (*zipped.path[:-1], zipped.name[: -len(".zip")])
    files: list[Member] = []
    for number, file in enumerate(in_zip(_opened(now, budget), [], above)):
        later = Member(file.path, partial(_read_again, zipped, above, number))
        files += _inner(later, file, depth - 1, budget)
        if len(files) > MOST:
            raise TooManyError(f"it holds more than {MOST} files")
    return files


def _inner(later: Member, now: Member, depth: int, budget: Budget) -> list[Member]:
    """Return a file, or the files in it if it is a zip that can be read. For the arguments see `_held`."""
    if not is_zip(now.name) or not depth:
        return [later]
    try:
        return _held(later, now, depth, budget) or [later]
    except TooManyError:
        raise
    except Exception:  # a damaged zip raises many kinds of errors; it then counts as an ordinary file
        return [later]


def _read_again(zipped: Member, above: tuple[str, ...], number: int, most: int) -> bytes:
    """Read one file of a zip, given by its number, because two files may have the same name."""
    for at, file in enumerate(in_zip(_opened(zipped), [], above)):
        if at == number:
            return file.read(most)
    raise OSError("it is not in the zip any more")


def _opened(member: Member, budget: Budget | None = None) -> zipfile.ZipFile:
    content = member.read(_ZIP_BYTES + 1)
    if len(content) > _ZIP_BYTES:
        raise OSError(f"it is larger than {_ZIP_BYTES // 1024**2} MiB")
    if budget is not None:
        budget.take(content)
    return zipfile.ZipFile(io.BytesIO(content))
