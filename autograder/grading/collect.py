"""Takes in what was handed in: a folder or a zip with a folder for each student, into `build/submitted`.

Of each student only the lab's notebook is taken, as bytes. Names are checked, links are not followed, nothing is
unpacked to a place that a name in a zip could choose.
"""

from __future__ import annotations

import os
import re
import stat
import zipfile
from dataclasses import dataclass, field
from pathlib import Path, PurePosixPath

from autograder.errors import KitError
from autograder.files import write_beside
from autograder.submission.reader import NOTEBOOK_BYTES

_STUDENT = re.compile(r"[\w](?:[\w .@+-]{0,62}[\w@+-])?")
_NOBODYS = (".", "__MACOSX")
"""What the name of a folder begins with that a system or a packer made."""
_MANY = 20_000
"""More entries than this in a zip are no class."""


@dataclass
class Collected:
    """What was taken in."""

    notebooks: dict[str, Path] = field(default_factory=dict)
    """The notebook under `build/submitted`, by student; an empty file where nothing usable was handed in."""
    refused: list[str] = field(default_factory=list)
    """What was not taken in and why, as sentences."""


def collect(source: Path, lab: str, root: Path) -> Collected:
    """Take in a class.

    Args:
        source: a folder or a zip that holds `<student>/<lab>.ipynb` or `<student>/<lab>/<lab>.ipynb`; in a zip, one
            more folder around them does no harm.
        lab: to take.
        root: of the course.

    Raises:
        KitError: there is nothing to take in.
    """
    collected = Collected()
    take = _from_folder if source.is_dir() else _from_zip
    found = take(source, lab, collected.refused)
    for student, content in sorted(found.items()):
        if not _STUDENT.fullmatch(student):
            collected.refused.append(f"The folder {student[:80]!r} cannot be a student's name; it was left out.")
            continue
        path = root / "build" / "submitted" / student / lab / f"{lab}.ipynb"
        # An unchanged file keeps its time: nbgrader and people can see that nothing new was handed in.
        if not path.is_file() or path.read_bytes() != content:
            write_beside(path, content)
        collected.notebooks[student] = path
    if not collected.notebooks:
        raise KitError(f"There are no submissions in {source}.", f"Each student needs a folder that holds {lab}.ipynb.")
    return collected


def _from_folder(source: Path, lab: str, refused: list[str]) -> dict[str, bytes]:
    found: dict[str, bytes] = {}
    for entry in sorted(source.iterdir()):
        if not entry.is_dir() or entry.is_symlink() or entry.name.startswith(_NOBODYS):
            continue
        try:
            found[entry.name] = _notebook_in(entry, lab)
        except OSError as error:  # such as a folder that may not be entered: the class goes on
            found[entry.name] = b""
            refused.append(f"{entry} cannot be read ({error.strerror}); it counts as handed in without a notebook.")
    return found


def _notebook_in(folder: Path, lab: str) -> bytes:
    """Return a student's notebook: by its name, or the only notebook there is, for downloads get renamed.

    Raises:
        OSError: the folder may not be read.
    """
    entries = sorted(folder.iterdir())
    for candidate in (folder / f"{lab}.ipynb", folder / lab / f"{lab}.ipynb"):
        if candidate.exists() or candidate.is_symlink():
            return _bytes(candidate)
    others = [path for path in entries if path.suffix == ".ipynb"] or sorted((folder / lab).glob("*.ipynb"))
    return _bytes(others[0]) if len(others) == 1 else b""


def _bytes(path: Path) -> bytes:
    """Return a file's bytes, one more than the reader accepts at most; none of a link or anything but a file."""
    try:
        descriptor = os.open(path, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK)
        with os.fdopen(descriptor, "rb") as file:
            return file.read(NOTEBOOK_BYTES + 1) if stat.S_ISREG(os.fstat(descriptor).st_mode) else b""
    except OSError:
        return b""


def _open_zip(source: Path, lab: str) -> zipfile.ZipFile:
    try:
        return zipfile.ZipFile(source)
    except Exception as error:  # a damaged directory raises more than BadZipFile
        raise KitError(
            f"{source} is neither a folder nor a zip that can be read ({error}).",
            f"Give a folder that holds `<student>/{lab}.ipynb` for each student, or a whole zip of it.",
        ) from error


def _from_zip(source: Path, lab: str, refused: list[str]) -> dict[str, bytes]:
    found: dict[str, bytes] = {}
    others: dict[str, list[zipfile.ZipInfo]] = {}
    with _open_zip(source, lab) as archive:
        members = [member for member in archive.infolist() if not member.is_dir()]
        if len(members) > _MANY:
            raise KitError(f"{source} has {len(members)} entries; that is no class.", "Check the file.")
        paths = [(_parts(member.filename), member) for member in members]
        depth = _depth([parts for parts, _ in paths], lab)
        for parts, member in paths:
            inside = parts[depth:]
            if len(inside) < 2:
                continue
            student, rest = inside[0], inside[1:]
            found.setdefault(student, b"")
            if rest in ((f"{lab}.ipynb",), (lab, f"{lab}.ipynb")):
                found[student] = _member(archive, member, refused)
            elif rest[-1].endswith(".ipynb") and (len(rest) == 1 or rest[:-1] == (lab,)):
                others.setdefault(student, []).append(member)
        for student, candidates in others.items():
            if not found[student] and len(candidates) == 1:
                found[student] = _member(archive, candidates[0], refused)
    return found


def _parts(name: str) -> tuple[str, ...]:
    """Return a member's path as names; empty if it tries to leave its folder, or belongs to the packer."""
    path = PurePosixPath(name.replace("\\", "/"))
    if path.is_absolute() or ".." in path.parts or any(part.startswith(_NOBODYS) for part in path.parts):
        return ()
    return path.parts


def _depth(paths: list[tuple[str, ...]], lab: str) -> int:
    """How many folders to skip: 1 if everything lies in one folder that holds the students' folders."""
    real = [path for path in paths if path]
    one_top = len({path[0] for path in real}) == 1
    is_student = any(path[1:] == (f"{lab}.ipynb",) or path[1:2] == (lab,) for path in real)
    return 1 if one_top and not is_student and any(len(path) >= 3 for path in real) else 0


def _member(archive: zipfile.ZipFile, member: zipfile.ZipInfo, refused: list[str]) -> bytes:
    try:
        with archive.open(member) as file:
            return file.read(NOTEBOOK_BYTES + 1)
    except Exception as error:  # each way of packing fails in its own way (zlib.error, LZMAError); the class goes on
        refused.append(f"{member.filename} in the zip cannot be read ({error}); it counts as an empty file.")
        return b""
