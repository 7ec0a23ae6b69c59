"""The roster: a table of the class, by which a platform's names become the names of the gradebook.

A CSV file with a line of headings. `id` is the name in the gradebook; `name`, `email`, `section`, `canvas_id`,
`moodle_id`, `github` and others are what platforms call the same student.
"""

from __future__ import annotations

import csv
import unicodedata
from collections.abc import Mapping
from pathlib import Path

from autograder.core.errors import KitError

FILE_NAME = "roster.csv"


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
                for word in _ways(heading, value):
                    self._known.setdefault(word, set()).add(student)

    def student(self, owner: Mapping[str, str]) -> str | None:
        """Return whom a platform means; None if nobody, or more than one.

        Args:
            owner: what it calls the student, by kind.
        """
        for kind in ("id", "canvas_id", "moodle_id", "email", "github", "name", "canvas"):
            for word in _ways(kind, owner.get(kind, "")):
                found = self._known.get(word, set())
                if len(found) == 1:
                    return next(iter(found))
        return None


def _ways(kind: str, value: str) -> set[str]:
    """The forms in which a value may be met: numbers of platforms by their kind, names by their words in any order."""
    plain = unicodedata.normalize("NFKC", value).strip().casefold()
    if not plain:
        return set()
    if kind.endswith("_id"):
        return {f"{kind} {plain}"}
    if kind == "canvas":  # letters alone, the family name first
        return {f"canvas {plain}"}
    if kind == "name":
        words = plain.replace(",", " ").split()
        squashed = {"".join(words[turn:] + words[:turn]) for turn in range(len(words))}
        letters = {"".join(character for character in word if character.isalnum()) for word in squashed}
        return {" ".join(sorted(words)), *(f"canvas {word}" for word in letters)}
    return {plain, plain.partition("@")[0]} if kind == "email" else {plain}


def read_roster(path: Path) -> Roster:
    """Read a roster.

    Raises:
        KitError: it cannot be read, has no column `id`, or one id twice.
    """
    try:
        with path.open(encoding="utf-8-sig", newline="") as file:
            reader = csv.DictReader(file)
            lines = [(reader.line_num, line) for line in reader]
    except (OSError, UnicodeError, csv.Error) as error:
        raise KitError(f"The roster {path} cannot be read: {error}.", "It is a CSV file in UTF-8.") from error
    students: dict[str, dict[str, str]] = {}
    for number, line in lines:
        known = {(key or "").strip().lower(): value.strip() for key, value in line.items() if isinstance(value, str)}
        if not any(known.values()):  # spreadsheets write lines of nothing but commas
            continue
        student = known.get("id", "")
        if not student:
            raise KitError(
                f"Line {number} of the roster {path} has no `id`.", "Its first line names the columns: id,name,email,…"
            )
        if student in students:
            raise KitError(
                f"The roster {path} names {student!r} twice, the second time in line {number}.", "Keep one of the two."
            )
        students[student] = known
    return Roster(students)
