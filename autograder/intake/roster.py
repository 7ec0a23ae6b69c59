"""The roster: a table of the class, by which a platform's names become the names of the gradebook.

A CSV file with a line of headings, or the roster that GitHub Classroom gives out. `id` is the name in the gradebook;
`name`, `email`, `section`, `canvas_id`, `moodle_id`, `github` and others are what platforms call the same student.
"""

from __future__ import annotations

import codecs
import csv
import io
import re
import unicodedata
from collections.abc import Mapping
from pathlib import Path

from autograder.core.errors import KitError

FILE_NAME = "roster.csv"
_OF_CLASSROOM = {"identifier": "id", "github_username": "github"}
"""What GitHub Classroom calls the columns of the roster that it gives out."""


class Roster:
    """The students of a class."""

    def __init__(self, students: Mapping[str, Mapping[str, str]]) -> None:
        """Take them.

        Args:
            students: what is known of each, by heading, by their id.
        """
        self.students = students
        self._known: dict[str, set[str]] = {}
        for student, line in students.items():
            for heading, value in line.items():
                for word in _ways(heading, value) if heading != "section" else ():
                    self._known.setdefault(word, set()).add(student)

    def student(self, owner: Mapping[str, str]) -> str | None:
        """Return whom a platform means; None if nobody, or more than one.

        Args:
            owner: what it calls the student, by kind.
        """
        if owner.get("id") in self.students:  # even if another student is called so elsewhere
            return owner["id"]
        for kind in ("id", "canvas_id", "moodle_id", "email", "github", "name", "canvas"):
            for word in _ways(kind, owner.get(kind, "")):
                found = self._known.get(word, set())
                if len(found) == 1:
                    return next(iter(found))
        # The name of a repository ends with its owner's, either of which may have hyphens.
        name = owner.get("repository", "").partition("-")[2]
        return self.student({"github": name, "repository": name}) if name else None


def _ways(kind: str, value: str) -> set[str]:
    """The forms in which a value may be met: numbers of platforms by their kind, names by their words in any order."""
    plain = unicodedata.normalize("NFKC", value).strip().casefold()
    if not plain:
        return set()
    if kind.endswith("_id"):
        return {f"{kind} {plain}"}
    if kind == "canvas":  # letters alone, the family name first; some take the accents away
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
    """Read a roster, as an editor or a spreadsheet writes it: Excel has its own encodings and separators.

    Raises:
        KitError: it cannot be read, has no column `id`, names nobody, or one id twice.
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
    other = _OF_CLASSROOM if "id" not in columns else {}
    columns = [other.get(name, name) for name in columns]
    if "id" not in columns:
        raise KitError(
            f"The roster {path} has no column `id`; its first line is {heading[:80]!r}.",
            "The first line names the columns: id,name,email,…",
        )
    students: dict[str, dict[str, str]] = {}
    for number, line in lines:
        given = {(key or "").strip().lower(): value.strip() for key, value in line.items() if isinstance(value, str)}
        named = {other.get(key, key): value for key, value in given.items()}
        # Spreadsheets give a column of numbers in which one is missing a decimal point: 4711.0.
        known = {
            key: re.sub(r"^(\d+)\.0+$", r"\1", value) if key.endswith("_id") else value for key, value in named.items()
        }
        if not any(known.values()):  # spreadsheets write lines of nothing but commas
            continue
        student = known.get("id", "")
        if not student:
            raise KitError(f"Line {number} of the roster {path} has no `id`.", "Give each student one, or none a line.")
        if student in students:
            raise KitError(
                f"The roster {path} names {student!r} twice, the second time in line {number}.", "Keep one of the two."
            )
        students[student] = known
    if not students:
        raise KitError(f"The roster {path} names nobody.", "Write a line for each student, or remove the file.")
    return Roster(students)


def _decoded(content: bytes) -> str:
    """The text of a file in UTF-8, in Excel's UTF-16, or in the character set of a Western Windows."""
    if content.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        return content.decode("utf-16")
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError:
        return content.decode("cp1252")
