"""The roster: a table of the class that maps a platform's names to the names in the gradebook.

The roster is a CSV file with a line of headings, or the `roster.csv` of a classroom in Classroom 50. The column `id` is
the name in the gradebook. Columns such as `name`, `email`, `canvas_id`, `moodle_id` and `github` hold the names of the
same student on platforms.

Without a roster, students keep the names that they had before, or get the names that the platform uses.
"""

from __future__ import annotations

import codecs
import csv
import hashlib
import io
import os
import re
import unicodedata
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from autograder.core.errors import KitError
from autograder.intake.entries import Claim
from autograder.intake.record import person
from autograder.intake.words import some

FILE_NAME = "roster.csv"
_OF_CLASSROOM50 = {"username", "first_name", "last_name", "github_id"}
"""Columns of a classroom's roster in Classroom 50, which has no column `id`. Source: its wiki, `gh teacher roster`."""
_STAFF = ("teacher", "hta", "ta")
"""The roles of people in Classroom 50's roster who are not students."""


class Roster:
    """The students of a class."""

    def __init__(self, students: Mapping[str, Mapping[str, str]]) -> None:
        """Index the students by all of their names.

        Args:
            students: for each student's id, the values in the roster by heading.
        """
        self.students = students
        self._known: dict[str, set[str]] = {}
        for student, line in students.items():
            for heading, value in line.items():
                for word in _ways(heading, value) if heading != "section" else ():
                    self._known.setdefault(word, set()).add(student)

    @property
    def shared(self) -> list[str]:
        """Sentences about numbers and names on platforms that the roster gives to more than one student."""
        found: dict[tuple[str, str], list[str]] = {}
        for student, line in self.students.items():
            for heading, value in line.items():
                if value and (heading.endswith("_id") or heading in ("email", "github")):
                    found.setdefault((heading, value.casefold()), []).append(student)
        return [
            f"The roster gives the {heading} {value[:80]!r} to {some([repr(name[:80]) for name in names], ' and ')}, so"
            " it identifies neither of them. If they are one person, keep one line of the roster."
            for (heading, value), names in found.items()
            if len(names) > 1
        ]

    def holder(self, kind: str, value: str) -> str | None:
        """Return the id of the only student who has a number or name on a platform; None if there is none."""
        found = [student for student, line in self.students.items() if line.get(kind, "") == value]
        return found[0] if len(found) == 1 else None

    def student(self, owner: Mapping[str, str]) -> str | None:
        """Return the id of the student that a platform's names belong to; None if there is no or more than one match.

        Args:
            owner: the platform's names for the student, by kind.
        """
        if owner.get("id") in self.students:  # even if another student has this name on a platform
            return owner["id"]
        for kind in ("id", "canvas_id", "moodle_id", "email", "github", "name", "canvas"):
            for word in _ways(kind, owner.get(kind, "")):
                found = self._known.get(word, set())
                if len(found) == 1:
                    return next(iter(found))
        # The name of a repository ends with the name of its owner, and both parts may contain hyphens.
        name = owner.get("repository", "").partition("-")[2]
        return self.student({"github": name, "repository": name}) if name else None


def _ways(kind: str, value: str) -> set[str]:
    """Return the normalised forms of a value by which it is found.

    A platform's number includes its kind, and the words of a name may be in any order.
    """
    plain = unicodedata.normalize("NFKC", value).strip().casefold()
    if not plain:
        return set()
    if kind.endswith("_id"):
        return {f"{kind} {plain}"}
    if kind == "canvas":  # only letters, with the family name first; sometimes without accents
        return {f"canvas {plain}", f"canvas {_without_accents(plain)}"}
    if kind == "name":
        words = plain.replace(",", " ").split()
        squashed = {"".join(words[turn:] + words[:turn]) for turn in range(len(words))}
        letters = {"".join(character for character in word if character.isalnum()) for word in squashed}
        letters |= {_without_accents(word) for word in letters}
        return {" ".join(sorted(words)), *(f"canvas {word}" for word in letters)}
    return {plain, plain.partition("@")[0]} if kind == "email" else {plain}


def _without_accents(word: str) -> str:
    parts = unicodedata.normalize("NFKD", word)
    return "".join(character for character in parts if not unicodedata.combining(character))


def read_roster(path: Path) -> Roster:
    """Read a roster that was saved by an editor or a spreadsheet. Excel uses other encodings and separators.

    Raises:
        KitError: the roster cannot be read, has no column `id`, lists no student, or lists an id twice.
    """
    try:
        text = _decoded(path.read_bytes()).lstrip("\r\n")
        heading = text.splitlines()[0] if text else ""
        separator = max(",;\t", key=heading.count)
        reader = csv.DictReader(io.StringIO(text, newline=""), delimiter=separator)
        lines = [(reader.line_num, line) for line in reader]
    except (OSError, UnicodeError, csv.Error) as error:
        raise KitError(f"The roster {path} cannot be read: {error}.", "It is a CSV file in UTF-8.") from error
    columns = [(name or "").strip().lower() for name in reader.fieldnames or []]
    of_classroom50 = "id" not in columns and set(columns) >= _OF_CLASSROOM50
    if "id" not in columns and not of_classroom50:
        raise KitError(
            f"The roster {path} has no column `id`; its first line is {heading[:80]!r}.",
            "The first line names the columns: id,name,email,…",
        )
    students: dict[str, dict[str, str]] = {}
    for number, line in lines:
        given = {(key or "").strip().lower(): value.strip() for key, value in line.items() if isinstance(value, str)}
        if of_classroom50:
            if given.get("role") in _STAFF:
                continue
            name = f"{given.get('first_name', '')} {given.get('last_name', '')}".strip()
            given |= {"id": given.get("username", ""), "github": given.get("username", ""), "name": name}
        # If one number in a column is missing, spreadsheets write the others with a decimal point: 4711.0.
        known = {
            key: re.sub(r"^(\d+)\.0+$", r"\1", value) if key.endswith("_id") else value for key, value in given.items()
        }
        if not any(known.values()):  # spreadsheets may write lines that contain only commas
            continue
        student = known.get("id", "")
        if not student:
            raise KitError(f"Line {number} of the roster {path} has no `id`.", "Add an `id`, or remove this line.")
        if student in students:
            raise KitError(
                f"The roster {path} lists {student!r} twice, the second time in line {number}.", "Keep one of the two."
            )
        students[student] = known
    if not students:
        raise KitError(f"The roster {path} lists nobody.", "Write a line for each student, or remove the file.")
    return Roster(students)


def _decoded(content: bytes) -> str:
    """Decode a file in UTF-8, in Excel's UTF-16, or in the character set of Western versions of Windows."""
    if content.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        return content.decode("utf-16")
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError:
        return content.decode("cp1252")


_NOT_FIRST = " .@+-,()"
"""Characters that have a special meaning for a shell, a spreadsheet or a listing at the beginning of a name."""
_NOT_LAST = " ."
_NAME_BYTES = 120
"""The longest name in bytes. The gradebook allows 128 characters, and a file's name with all its parts 255 bytes."""


@dataclass
class Student:
    """A student and the entries that belong to the student."""

    name: str
    claims: list[Claim] = field(default_factory=list)
    listed: bool = True
    """Whether the student is in the roster; also True if there is no roster."""


def named(claims: Sequence[Claim], roster: Roster | None, before: Mapping[tuple[str, str], str]) -> list[Student]:
    """Return the students of a class, one for each owner. Two of them may have the same name.

    Students who were taken in before keep their names, even if others with the same name hand in later. If nothing says
    which of two entries of one owner is the later one, each of them becomes a student with that name.

    Args:
        claims: for each entry, to whom it belongs.
        roster: the course's roster, if it has one.
        before: the names in the gradebook of persons who were taken in before.
    """
    by_owner: dict[tuple[object, ...], list[Claim]] = {}
    for claim in claims:
        in_turn = claim.attempt or claim.turn
        by_owner.setdefault((*sorted(claim.owner.items()), None if in_turn else id(claim)), []).append(claim)
    owners = [group[0].owner for group in by_owner.values()]
    names = _by_roster(owners, roster) if roster is not None else _by_platform(owners, before)
    return [
        Student(name or given_name(owner), group, listed=roster is None or bool(name))
        for owner, name, group in zip(owners, names, by_owner.values(), strict=True)
    ]


def _by_roster(owners: Sequence[Mapping[str, str]], roster: Roster) -> list[str]:
    """Return the roster's ids of the owners; an empty one if the roster does not have the owner."""
    found = []
    for owner in owners:
        plain = set(owner) == {"id"}  # the name of a folder may be any kind of name
        ways = dict.fromkeys(("id", "email", "name", "github"), owner["id"]) if plain else owner
        found.append(roster.student(ways) or "")
    return found


def _by_platform(owners: Sequence[Mapping[str, str]], before: Mapping[tuple[str, str], str]) -> list[str]:
    """Return the platform's names of the owners; if two persons have the same name, with the platform's number."""
    persons = [person(owner) for owner in owners]
    given = [given_name(owner) for owner in owners]
    many = Counter(name for name, who in zip(given, persons, strict=True) if who is not None)
    taken = {name: who for who, name in before.items()}
    names = []
    for name, who in zip(given, persons, strict=True):
        known = before.get(who) if who is not None else None
        others = who is not None and (many[name] > 1 or taken.get(name, who) != who)
        names.append(known or (f"{name}_{who[1]}" if who is not None and others else name))
    return names


def given_name(owner: Mapping[str, str]) -> str:
    """Return the name that a platform gives a student."""
    return next((owner[kind] for kind in ("id", "github", "name", "canvas", "email") if owner.get(kind)), "")


def file_name(given: str) -> str:
    """Return a student's name in a form that is safe as the name of a file or page; empty if `given` is empty.

    Accents are combined with their letters, because a Mac writes the `é` in `José` as two characters and other systems
    as one. If a name is too long or contains characters with a special meaning, it is changed, and a digest of the
    original name is added so that it stays different from all others.
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
    """Return whether a name may contain this character: letters, digits and marks of any script, and separators."""
    return unicodedata.category(character)[0] in "LMN" or character in "_ .@+-,'\u2018\u2019()"
