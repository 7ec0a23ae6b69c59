"""Takes in what was handed in: a folder or a zip with a folder for each student, into `build/submitted`.

Of each student only the lab's notebook is taken, as bytes, and when it was handed in. Names are checked, links are not
followed, nothing is unpacked to a place that a name in a zip could choose. What is not taken is said, and costs nobody
else anything.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
import re
import stat
import unicodedata
import zipfile
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path, PurePosixPath

from autograder.core.errors import KitError
from autograder.core.files import read_plain, write_beside
from autograder.course.paths import CoursePaths
from autograder.submission import timestamp
from autograder.submission.notebook_file import NOTEBOOK_BYTES

_NAME_BYTES = 120
"""A longer name is shortened: a gradebook takes 128 characters, a file's name 255 bytes with what is put around it."""
_PACKERS_PREFIXES = (".", "__MACOSX")
"""What the name of a folder begins with that a system or a packer made."""
_MOST_ENTRIES = 20_000
"""More entries than this in a zip are no class."""
_NAMED = 5
"""Of more bad names than this only their number is said."""


_CLOSED = """\
# Here lie submissions under the names that nbgrader looks for. Without this file, nbgrader started in this folder
# would take it for a course of its own, and execute them.
import sys

sys.exit("This folder is not a course: start nbgrader in the folder above it. Nothing was executed.")
"""


@dataclass
class _HandedIn:
    """What lies in a student's folder."""

    notebook: bytes = b""
    """Empty: there is none that can be used."""
    timestamp: bytes = b""
    """Empty: nothing says when it was handed in."""


@dataclass
class Collected:
    """What was taken in."""

    notebooks: dict[str, Path] = field(default_factory=dict)
    """The notebook under `build/submitted`, by student; an empty file where nothing usable was handed in."""
    refused: list[str] = field(default_factory=list)
    """What was not taken in, or only under another name, and why, as sentences."""


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
    paths = CoursePaths(root)
    if found and not (paths.build / "nbgrader_config.py").is_file():
        write_beside(paths.build / "nbgrader_config.py", _CLOSED)
    owners: dict[str, str] = {}
    for folder, handed_in in sorted(found.items(), key=lambda item: item[0]):
        student = _student(folder)
        if student is None:
            collected.refused.append(f"The folder {folder[:80]!r} cannot be a student's name; it was left out.")
            continue
        if student in owners:
            twice = f"The folders {owners[student][:80]!r} and {folder[:80]!r} mean the same student"
            collected.refused.append(f"{twice}; the second was left out.")
            continue
        owners[student] = folder
        if student != unicodedata.normalize("NFC", folder):
            collected.refused.append(f"The name {folder[:80]!r} is too long; the student is called {student!r} here.")
        path = paths.submitted_notebook(student, lab)
        # An unchanged file keeps its time: nbgrader and people can see that nothing new was handed in.
        if _read(paths.submitted, [student, lab, path.name]) != handed_in.notebook:
            _make_room(paths.submitted, student, lab)
            write_beside(path, handed_in.notebook)
        _keep_timestamp(paths.submitted, student, lab, handed_in.timestamp, collected.refused)
        collected.notebooks[student] = path
    if not collected.notebooks:
        raise KitError(f"There are no submissions in {source}.", f"Each student needs a folder that holds {lab}.ipynb.")
    return collected


def _keep_timestamp(submitted: Path, student: str, lab: str, content: bytes, refused: list[str]) -> None:
    """Write when a student handed in to where nbgrader looks for it, which decides about penalties."""
    path = submitted / student / lab / timestamp.FILE_NAME
    said = timestamp.moment(content) if content else ""
    if said is None:
        refused.append(f"{timestamp.FILE_NAME} of {student} is no date and time; it was left out.")
    if not said:
        path.unlink(missing_ok=True)
    elif _read(submitted, [student, lab, path.name]) != said.encode():
        write_beside(path, said)


def _student(folder: str) -> str | None:
    """The name by which a student is known here; None if the folder's name cannot be made one.

    Accents are joined to their letters: a Mac writes `José` with two characters where other systems write one. A long
    name is cut and made different again by a digest of the whole.
    """
    name = unicodedata.normalize("NFC", folder)
    if not all(_in_names(character) for character in name) or not re.match(r"\w", name) or name[-1] in " .":
        return None
    if len(os.fsencode(name)) <= _NAME_BYTES:
        return name
    digest = hashlib.sha256(name.encode("utf-8")).hexdigest()[:8]
    return f"{name.encode()[: _NAME_BYTES - 9].decode('utf-8', 'ignore').rstrip(' .')}-{digest}"


def _in_names(character: str) -> bool:
    """Letters and digits of any script with their marks, and what stands between the parts of names."""
    return unicodedata.category(character)[0] in "LMN" or character in "_ .@+-,'\u2019()"


def _read(folder: Path, parts: Sequence[str]) -> bytes | None:
    with contextlib.suppress(OSError):
        return read_plain(folder, parts, NOTEBOOK_BYTES + 1)
    return None


def _make_room(submitted: Path, student: str, lab: str) -> None:
    """Remove links that lie where a notebook is to be written: writing would follow them."""
    for path in (submitted / student, submitted / student / lab):
        if path.is_symlink():
            path.unlink()


def _from_folder(source: Path, lab: str, refused: list[str]) -> dict[str, _HandedIn]:
    found: dict[str, _HandedIn] = {}
    for entry in sorted(source.iterdir()):
        if entry.name.startswith(_PACKERS_PREFIXES):
            continue
        if entry.is_symlink():
            refused.append(f"{_shown(entry)} is a link; links are not followed, so it was left out.")
        elif entry.is_dir():
            try:
                found[entry.name] = _HandedIn(_notebook_in(source, entry.name, lab), _stamp_in(source, entry.name, lab))
            except OSError as error:  # such as a folder that may not be entered: the class goes on
                found[entry.name] = _HandedIn()
                why = f"{_shown(entry)} cannot be read ({error.strerror})"
                refused.append(f"{why}; it counts as handed in without a notebook.")
    return found


def _shown(path: Path) -> str:
    return str(path).encode("utf-8", "replace").decode()


def _notebook_in(source: Path, student: str, lab: str) -> bytes:
    """Return a student's notebook: by its name, or the only notebook there is, for downloads get renamed.

    Raises:
        OSError: the folder or the notebook may not be read, or a part of the way is a link or something else.
    """
    folder = source / student
    entries = sorted(path.name for path in folder.iterdir())
    inner = folder / lab
    below = sorted(path.name for path in inner.iterdir()) if inner.is_dir() and not inner.is_symlink() else []
    for parts in ([f"{lab}.ipynb"], [lab, f"{lab}.ipynb"]):
        if os.path.lexists(folder.joinpath(*parts)):
            return read_plain(source, [student, *parts], NOTEBOOK_BYTES + 1)
    others = [[name] for name in entries if name.endswith(".ipynb")]
    others = others or [[lab, name] for name in below if name.endswith(".ipynb")]
    if inner.is_symlink() and not others:
        return read_plain(source, [student, lab, f"{lab}.ipynb"], 0)  # which says that it is a link
    return read_plain(source, [student, *others[0]], NOTEBOOK_BYTES + 1) if len(others) == 1 else b""


def _stamp_in(source: Path, student: str, lab: str) -> bytes:
    for folders in ([], [lab]):
        with contextlib.suppress(OSError):
            return read_plain(source, [student, *folders, timestamp.FILE_NAME], timestamp.MOST_BYTES)
    return b""


def _open_zip(source: Path, lab: str) -> zipfile.ZipFile:
    try:
        return zipfile.ZipFile(source)
    except Exception as error:  # a damaged directory raises more than BadZipFile
        raise KitError(
            f"{source} is neither a folder nor a zip that can be read ({error}).",
            f"Give a folder that holds `<student>/{lab}.ipynb` for each student, or a whole zip of it.",
        ) from error


def _from_zip(source: Path, lab: str, refused: list[str]) -> dict[str, _HandedIn]:
    found: dict[str, _HandedIn] = {}
    others: dict[str, list[zipfile.ZipInfo]] = {}
    with _open_zip(source, lab) as archive:
        members = archive.infolist()
        if len(members) > _MOST_ENTRIES:
            raise KitError(f"{source} has {len(members)} entries; that is no class.", "Check the file.")
        paths = _paths(members, refused)
        depth = _depth([parts for parts, _ in paths], lab)
        for parts, member in paths:
            inside = parts[depth:]
            if len(inside) < 2:
                continue
            student, rest = inside[0], inside[1:]
            handed_in = found.setdefault(student, _HandedIn())
            if rest in ((f"{lab}.ipynb",), (lab, f"{lab}.ipynb")):
                handed_in.notebook = _member(archive, member, refused)
            elif rest in ((timestamp.FILE_NAME,), (lab, timestamp.FILE_NAME)):
                handed_in.timestamp = _member(archive, member, refused)[: timestamp.MOST_BYTES]
            elif rest[-1].endswith(".ipynb") and (len(rest) == 1 or rest[:-1] == (lab,)):
                others.setdefault(student, []).append(member)
        for student, candidates in others.items():
            if not found[student].notebook and len(candidates) == 1:
                found[student].notebook = _member(archive, candidates[0], refused)
    return found


def _paths(members: Sequence[zipfile.ZipInfo], refused: list[str]) -> list[tuple[tuple[str, ...], zipfile.ZipInfo]]:
    """The files in a zip by their paths; what a packer adds is left out, and names that no file may have are said."""
    paths = []
    bad = []
    for member in members:
        path = PurePosixPath(_name(member).replace("\\", "/"))
        if not path.parts or path.is_absolute() or ".." in path.parts or "\0" in member.orig_filename:
            bad.append(repr(member.orig_filename[:60]))
        elif not member.is_dir() and not any(part.startswith(_PACKERS_PREFIXES) for part in path.parts):
            paths.append((path.parts, member))
    if bad:
        names = ", ".join(bad[:_NAMED]) + (f" and {len(bad) - _NAMED} more" if len(bad) > _NAMED else "")
        refused.append(f"The zip has entries whose names lead nowhere in it; they were left out: {names}.")
    return paths


def _name(member: zipfile.ZipInfo) -> str:
    """A member's name; some packers write UTF-8 without saying so, which then is taken for the DOS character set."""
    if not member.flag_bits & 0x800:
        with contextlib.suppress(UnicodeError):
            return member.filename.encode("cp437").decode("utf-8")
    return member.filename


def _depth(paths: list[tuple[str, ...]], lab: str) -> int:
    """How many folders to skip: 1 if everything lies in one folder that holds the students' folders."""
    one_top = len({path[0] for path in paths}) == 1
    is_student = any(path[1:] == (f"{lab}.ipynb",) or path[1:2] == (lab,) for path in paths)
    return 1 if one_top and not is_student and any(len(path) >= 3 for path in paths) else 0


def _member(archive: zipfile.ZipFile, member: zipfile.ZipInfo, refused: list[str]) -> bytes:
    try:
        if stat.S_IFMT(member.external_attr >> 16) not in (0, stat.S_IFREG):
            raise OSError("it is a link or something else that is no file")
        with archive.open(member) as file:
            return file.read(NOTEBOOK_BYTES + 1)
    except Exception as error:  # each way of packing fails in its own way (zlib.error, LZMAError); the class goes on
        refused.append(f"{member.filename[:200]} in the zip cannot be read ({error}); it counts as an empty file.")
        return b""
