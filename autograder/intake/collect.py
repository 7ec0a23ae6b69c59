"""Takes in what was handed in: a folder or a zip with a folder for each student, into `build/submitted`.

Of each student only the lab's notebook is taken, as bytes, and what nbgrader's exchange puts beside it. Names are
checked, links are not followed, nothing is unpacked to a place that a name in a zip could choose. What is not taken is
said, and costs nobody else anything.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
import unicodedata
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

from autograder.core.errors import KitError
from autograder.core.files import read_plain, write_beside
from autograder.course.paths import CoursePaths
from autograder.intake.claims import Claim
from autograder.intake.formats import recognise
from autograder.intake.latest import latest
from autograder.intake.members import members
from autograder.intake.plain_class import HandedIn, plain_class
from autograder.intake.record import Taken, keep_class
from autograder.intake.roster import FILE_NAME, Roster, read_roster
from autograder.submission import exchange_secret, timestamp
from autograder.submission.notebook_file import NOTEBOOK_BYTES

_NOT_FIRST = " .@+-,()"
"""To a shell, a spreadsheet or a listing these mean something at the beginning of a name."""
_NOT_LAST = " ."
_NAME_BYTES = 120
"""A longer name is shortened: a gradebook takes 128 characters, a file's name 255 bytes with what is put around it."""


_CLOSED = """\
# Here lie submissions under the names that nbgrader looks for. Without this file, nbgrader started in this folder
# would take it for a course of its own, and execute them.
import sys

sys.exit("This folder is not a course: start nbgrader in the folder above it. Nothing was executed.")
"""


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
        found = plain_class(source, lab, collected.refused)
        if roster is not None:
            found = _by_roster(found, roster, collected)
    if found and not (paths.build / "nbgrader_config.py").is_file():
        write_beside(paths.build / "nbgrader_config.py", _CLOSED)
    owners: dict[str, str] = {}
    taken: dict[str, Taken] = {}
    for folder, handed_in in sorted(found.items(), key=lambda item: item[0]):
        student = _student(folder)
        if not student:
            collected.refused.append("A submission without a student's name was left out.")
            continue
        if student in owners:
            collected.refused.append(_twice(owners[student], folder))
            continue
        owners[student] = folder
        if student != unicodedata.normalize("NFC", folder):
            collected.notes.append(f"{folder[:80]!r} cannot be a file's name here; the student is called {student!r}.")
        path = paths.submitted_notebook(student, lab)
        # An unchanged file keeps its time: nbgrader and people can see that nothing new was handed in.
        if _read(paths.submitted, [student, lab, path.name]) != handed_in.notebook:
            _make_room(paths.submitted, student, lab)
            write_beside(path, handed_in.notebook)
        said = timestamp.moment(handed_in.timestamp) if handed_in.timestamp else ""
        if said is None:
            collected.refused.append(f"{timestamp.FILE_NAME} of {student} is no date and time; it was left out.")
        _keep(paths.submitted, [student, lab, timestamp.FILE_NAME], said or "")
        _keep(paths.submitted, [student, lab, exchange_secret.FILE_NAME], handed_in.secret)
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


def _of_platform(source: Path, lab: str, roster: Roster | None, collected: Collected) -> dict[str, HandedIn] | None:
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
    found: dict[str, HandedIn] = {}
    for student, claims in by_student.items():
        last = latest(claims, lab)
        if last is None:
            names = " and ".join(sorted(repr(claim.member.name[:100]) for claim in claims)[:2])
            collected.refused.append(f"{student} handed in {names}, none called {lab}.ipynb; it was left out.")
            continue
        try:
            content = last.member.read(NOTEBOOK_BYTES + 1)
        except Exception as error:  # each way of packing fails in its own way; the class goes on
            collected.refused.append(
                f"{last.member.name[:100]!r} of {student} cannot be read ({error}); it was left out."
            )
            continue
        if not content.strip():  # what an upload that failed leaves behind
            collected.refused.append(f"{last.member.name[:100]!r} of {student} is an empty file; it was left out.")
            continue
        found[student] = HandedIn(
            content, last.handed_in.encode(), last.secret, "/".join(last.member.path), last.owner, last.late
        )
        for claim in claims:
            if claim is not last:
                collected.notes.append(f"{student}: {last.member.name[:100]!r} replaces {claim.member.name[:100]!r}.")
        if last.late:
            collected.notes.append(f"{student}: {recognised.format} has marked it as late.")
    return found


def _called(claim: Claim, claims: Sequence[Claim]) -> str:
    """The name that a platform gives a student; with its number for them where two have one name."""
    owner = claim.owner
    name = next((owner[kind] for kind in ("id", "github", "name", "canvas", "email") if owner.get(kind)), "")
    number = owner.get("canvas_id") or owner.get("moodle_id") or ""
    others = (other.owner for other in claims if other.owner != owner)
    return f"{name}_{number}" if number and any(name in other.values() for other in others) else name


def _by_roster(found: dict[str, HandedIn], roster: Roster, collected: Collected) -> dict[str, HandedIn]:
    """A folder for each student: their names as the roster has them. Those that it does not have keep theirs."""
    named: dict[str, HandedIn] = {}
    folders: dict[str, str] = {}
    for folder, handed_in in sorted(found.items(), key=lambda item: item[0]):
        student = roster.student({"id": folder, "email": folder, "name": folder, "github": folder})
        name = student or folder
        if name in named:
            collected.refused.append(_twice(folders[name], folder))
            continue
        if student is None:
            collected.notes.append(f"{folder[:100]!r} is no student of the roster, and keeps this name.")
        named[name], folders[name] = handed_in, folder
    return named


def _twice(folder: str, other: str) -> str:
    return f"The folders {folder[:80]!r} and {other[:80]!r} mean the same student; the second was left out."


def _keep(submitted: Path, parts: Sequence[str], text: str) -> None:
    """Write what nbgrader looks for beside a notebook: when it was handed in, and how feedback on it is fetched."""
    path = submitted.joinpath(*parts)
    if not text:
        path.unlink(missing_ok=True)
    elif _read(submitted, parts) != text.encode():
        write_beside(path, text)


def _student(given: str) -> str:
    """The name by which a student is known here, which files and pages can have; empty if nothing was given.

    Accents are joined to their letters: a Mac writes `José` with two characters where other systems write one. A name
    that is long, or has characters that would mean something to a program, is made different from all others by a
    digest of the whole.
    """
    name = unicodedata.normalize("NFC", given)
    plain = "".join(character if _in_names(character) else "_" for character in name)
    if plain[:1] in _NOT_FIRST:
        plain = f"_{plain[1:]}"
    if plain[-1:] in _NOT_LAST:
        plain = f"{plain[:-1]}_"
    if not name or (plain == name and len(os.fsencode(name)) <= _NAME_BYTES):
        return name
    digest = hashlib.sha256(name.encode("utf-8", "surrogatepass")).hexdigest()[:8]
    return f"{plain.encode()[: _NAME_BYTES - 9].decode('utf-8', 'ignore').rstrip(_NOT_LAST)}-{digest}"


def _in_names(character: str) -> bool:
    """Letters and digits of any script with their marks, and what stands between the parts of names."""
    return unicodedata.category(character)[0] in "LMN" or character in "_ .@+-,'\u2018\u2019()"


def _read(folder: Path, parts: Sequence[str]) -> bytes | None:
    with contextlib.suppress(OSError):
        return read_plain(folder, parts, NOTEBOOK_BYTES + 1)
    return None


def _make_room(submitted: Path, student: str, lab: str) -> None:
    """Remove links that lie where a notebook is to be written: writing would follow them."""
    for path in (submitted / student, submitted / student / lab):
        if path.is_symlink():
            path.unlink()
