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
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path, PurePosixPath

from autograder.core.errors import KitError
from autograder.core.files import read_plain, write_beside
from autograder.course.paths import CoursePaths
from autograder.intake.formats import Claim, recognise
from autograder.intake.members import member_name, members
from autograder.intake.record import Taken, keep_class
from autograder.intake.roster import FILE_NAME, Roster, read_roster
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


class _NotUnderstood(Exception):
    """Something was handed in, and not in a way that says which notebook counts. Nobody gets a zero for that."""


@dataclass
class _HandedIn:
    """What lies in a student's folder."""

    notebook: bytes = b""
    """Empty: there is none that can be used."""
    timestamp: bytes = b""
    """Empty: nothing says when it was handed in."""
    file: str = ""
    owner: Mapping[str, str] = field(default_factory=dict)
    late: bool = False
    """These three as in `Taken`."""


@dataclass
class Collected:
    """What was taken in."""

    format: str = ""
    """The learning platform that the submissions came from; empty for a folder for each student."""
    notebooks: dict[str, Path] = field(default_factory=dict)
    """The notebook under `build/submitted`, by student; an empty file where nothing was handed in."""
    refused: list[str] = field(default_factory=list)
    """What was left out, and why, as sentences."""
    notes: list[str] = field(default_factory=list)
    """What replaced what, who was late, and who has another name here, as sentences."""


def collect(source: Path, lab: str, root: Path) -> Collected:
    """Take in a class.

    Args:
        source: a folder or a zip, as a learning platform gives it out (`formats`), or with `<student>/<lab>.ipynb` or
            `<student>/<lab>/<lab>.ipynb`; one more folder around them does no harm.
        lab: to take.
        root: of the course. A file `roster.csv` there joins the platforms' names to those of the gradebook.

    Raises:
        KitError: there is nothing to take in.
    """
    collected = Collected()
    paths = CoursePaths(root)
    roster = read_roster(root / FILE_NAME) if (root / FILE_NAME).is_file() else None
    found = _of_platform(source, lab, roster, collected)
    if found is None:
        take = _from_folder if source.is_dir() else _from_zip
        found = take(source, lab, collected.refused)
        if roster is not None:
            found = _by_roster(found, roster, collected)
    if found and not (paths.build / "nbgrader_config.py").is_file():
        write_beside(paths.build / "nbgrader_config.py", _CLOSED)
    owners: dict[str, str] = {}
    taken: dict[str, Taken] = {}
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
            collected.notes.append(f"The name {folder[:80]!r} is too long; the student is called {student!r} here.")
        path = paths.submitted_notebook(student, lab)
        # An unchanged file keeps its time: nbgrader and people can see that nothing new was handed in.
        if _read(paths.submitted, [student, lab, path.name]) != handed_in.notebook:
            _make_room(paths.submitted, student, lab)
            write_beside(path, handed_in.notebook)
        _keep_timestamp(paths.submitted, student, lab, handed_in.timestamp, collected.refused)
        collected.notebooks[student] = path
        taken[student] = Taken(
            source=str(source.resolve()), file=handed_in.file, owner=dict(handed_in.owner), late=handed_in.late
        )
    if not collected.notebooks:
        why = f" {collected.refused[0]}" if collected.refused else ""
        raise KitError(
            f"There are no submissions in {source}.{why}", f"Each student needs a folder that holds {lab}.ipynb."
        )
    collected.notes += keep_class(root, lab, source, taken, complete=not collected.refused)
    return collected


def _of_platform(source: Path, lab: str, roster: Roster | None, collected: Collected) -> dict[str, _HandedIn] | None:
    """What was handed in by student, if the source is what a learning platform gives out; None if not."""
    try:
        files = members(source)
    except Exception:  # a damaged zip: the plain way says what is wrong with it
        return None
    recognised = recognise(files, lab)
    if recognised is None:
        return None
    collected.format = recognised.format
    collected.refused += [f"{sentence} It was left out." for sentence in recognised.strange]
    by_student: dict[str, list[Claim]] = {}
    for claim in recognised.claims:
        student = roster.student(claim.owner) if roster is not None else _called(claim, recognised.claims)
        if student is None:
            who = ", ".join(claim.owner.values())[:100]
            collected.refused.append(f"{who!r} is no student of the roster, or more than one; it was left out.")
        else:
            by_student.setdefault(student, []).append(claim)
    found: dict[str, _HandedIn] = {}
    for student, claims in by_student.items():
        *earlier, last = sorted(claims, key=lambda claim: claim.turn)
        try:
            content = last.member.read(NOTEBOOK_BYTES + 1)
        except Exception as error:  # each way of packing fails in its own way; the class goes on
            collected.refused.append(
                f"{last.member.name[:100]!r} of {student} cannot be read ({error}); it was left out."
            )
            continue
        found[student] = _HandedIn(content, last.handed_in.encode(), "/".join(last.member.path), last.owner, last.late)
        for claim in earlier:
            collected.notes.append(f"{student}: {last.member.name[:100]!r} replaces {claim.member.name[:100]!r}.")
        if last.late:
            collected.notes.append(f"{student}: {recognised.format} has marked it as late.")
    return found


def _called(claim: Claim, claims: Sequence[Claim]) -> str:
    """The name that a platform gives a student; with its number for them where two have one name."""
    owner = claim.owner
    name = next(owner[kind] for kind in ("id", "github", "name", "canvas", "email") if owner.get(kind))
    number = owner.get("canvas_id") or owner.get("moodle_id") or ""
    others = (other.owner for other in claims if other.owner != owner)
    return f"{name}_{number}" if number and any(name in other.values() for other in others) else name


def _by_roster(found: dict[str, _HandedIn], roster: Roster, collected: Collected) -> dict[str, _HandedIn]:
    """A folder for each student: their names as the roster has them. Those that it does not have keep theirs."""
    named: dict[str, _HandedIn] = {}
    for folder, handed_in in found.items():
        student = roster.student({"id": folder, "email": folder, "name": folder, "github": folder})
        if student is None:
            collected.notes.append(f"{folder[:100]!r} is no student of the roster, and keeps this name.")
        named[student or folder] = handed_in
    return named


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
        elif entry.is_file() and entry.suffix.lower() == ".zip":
            try:
                found[entry.stem] = _HandedIn(_notebook_in_zip(entry, lab))
            except _NotUnderstood as reason:
                refused.append(f"{_shown(entry)} {reason}; it was left out.")
        elif entry.is_dir():
            try:
                found[entry.name] = _HandedIn(_notebook_in(source, entry.name, lab), _stamp_in(source, entry.name, lab))
            except OSError as error:  # such as a folder that may not be entered: the class goes on
                refused.append(f"{_shown(entry)} cannot be read ({error.strerror}); it was left out.")
            except _NotUnderstood as reason:
                refused.append(f"{_shown(entry)} {reason}; it was left out.")
    return found


def _shown(path: Path) -> str:
    return str(path).encode("utf-8", "replace").decode()


def _notebook_in(source: Path, student: str, lab: str) -> bytes:
    """Return a student's notebook; empty if there is nothing at all.

    Raises:
        OSError: the folder or the notebook may not be read, or a part of the way is a link or something else.
        _NotUnderstood: nothing says which notebook counts.
    """
    folder = source / student
    inner = folder / lab
    paths: list[tuple[str, ...]] = [(path.name,) for path in sorted(folder.iterdir()) if path != inner]
    if inner.is_symlink() or (inner.exists() and not inner.is_dir()):
        paths.append((lab, f"{lab}.ipynb"))  # reading it says what is in the way
    elif inner.is_dir():
        paths += [(lab, path.name) for path in sorted(inner.iterdir())]
    chosen = _choose(paths, lab)
    return read_plain(source, [student, *chosen], NOTEBOOK_BYTES + 1) if chosen else b""


def _notebook_in_zip(path: Path, lab: str) -> bytes:
    """Return the notebook in one student's zip.

    Raises:
        _NotUnderstood: the zip cannot be read, or nothing says which notebook counts.
    """
    try:
        files = {member.path: member for member in members(path)}
        while files and len({parts[0] for parts in files}) == 1 and all(len(parts) > 1 for parts in files):
            if next(iter(files))[0] == lab:
                break
            files = {parts[1:]: member for parts, member in files.items()}
        chosen = _choose([parts for parts in files if len(parts) == 1 or parts[:-1] == (lab,)], lab)
        return files[chosen].read(NOTEBOOK_BYTES + 1) if chosen else b""
    except _NotUnderstood:
        raise
    except Exception as error:  # a damaged zip raises many kinds
        raise _NotUnderstood(f"cannot be read ({error})") from error


def _choose(paths: Sequence[tuple[str, ...]], lab: str) -> tuple[str, ...]:
    """Which of a student's files is the notebook: by its name, or the only one, for downloads get renamed.

    Raises:
        _NotUnderstood: there are several, or only other files.
    """
    for exact in ((f"{lab}.ipynb",), (lab, f"{lab}.ipynb")):
        if exact in paths:
            return exact
    notebooks = [path for path in paths if path[-1].casefold().endswith(".ipynb")]
    notebooks = [path for path in notebooks if len(path) == 1] or notebooks
    named = [path for path in notebooks if path[-1].casefold() == f"{lab}.ipynb".casefold()]
    if len(named) == 1 or len(notebooks) == 1:
        return (named or notebooks)[0]
    if notebooks:
        raise _NotUnderstood(f"holds {len(notebooks)} notebooks, of which none is called {lab}.ipynb")
    strange = [path[-1] for path in paths if path[-1] != timestamp.FILE_NAME and not path[-1].startswith(".")]
    if strange:
        raise _NotUnderstood(f"holds {strange[0][:80]!r} and no notebook")
    return ()


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
    students: dict[str, dict[tuple[str, ...], zipfile.ZipInfo]] = {}
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
            students.setdefault(inside[0], {})[inside[1:]] = member
        for student, files in students.items():
            try:
                chosen = _choose([rest for rest in files if len(rest) == 1 or rest[:-1] == (lab,)], lab)
                stamp = files.get((timestamp.FILE_NAME,)) or files.get((lab, timestamp.FILE_NAME))
                found[student] = _HandedIn(
                    _member(archive, files[chosen]) if chosen else b"",
                    _member(archive, stamp)[: timestamp.MOST_BYTES] if stamp else b"",
                )
            except _NotUnderstood as reason:
                refused.append(f"{student[:80]!r} {reason}; it was left out.")
    return found


def _paths(members: Sequence[zipfile.ZipInfo], refused: list[str]) -> list[tuple[tuple[str, ...], zipfile.ZipInfo]]:
    """The files in a zip by their paths; what a packer adds is left out, and names that no file may have are said."""
    paths = []
    bad = []
    for member in members:
        path = PurePosixPath(member_name(member).replace("\\", "/"))
        if not path.parts or path.is_absolute() or ".." in path.parts or "\0" in member.orig_filename:
            bad.append(repr(member.orig_filename[:60]))
        elif not member.is_dir() and not any(part.startswith(_PACKERS_PREFIXES) for part in path.parts):
            paths.append((path.parts, member))
    if bad:
        names = ", ".join(bad[:_NAMED]) + (f" and {len(bad) - _NAMED} more" if len(bad) > _NAMED else "")
        refused.append(f"The zip has entries whose names lead nowhere in it; they were left out: {names}.")
    return paths


def _depth(paths: list[tuple[str, ...]], lab: str) -> int:
    """How many folders to skip: 1 if everything lies in one folder that holds the students' folders."""
    one_top = len({path[0] for path in paths}) == 1
    is_student = any(path[1:] == (f"{lab}.ipynb",) or path[1:2] == (lab,) for path in paths)
    return 1 if one_top and not is_student and any(len(path) >= 3 for path in paths) else 0


def _member(archive: zipfile.ZipFile, member: zipfile.ZipInfo) -> bytes:
    try:
        if stat.S_IFMT(member.external_attr >> 16) not in (0, stat.S_IFREG):
            raise OSError("it is a link or something else that is no file")
        with archive.open(member) as file:
            return file.read(NOTEBOOK_BYTES + 1)
    except Exception as error:  # each way of packing fails in its own way (zlib.error, LZMAError); the class goes on
        raise _NotUnderstood(f"holds {member.filename[:200]!r}, which cannot be read ({error})") from error
