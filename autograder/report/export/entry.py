"""What exports are made of: a class's submissions with what platforms call them, CSV, and the zip of feedback."""

from __future__ import annotations

import csv
import io
import zipfile
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from autograder.core.grades import Grade
from autograder.core.results import SubmissionResult


@dataclass(frozen=True)
class Entry:
    """One submission."""

    student: str
    lab: str
    result: SubmissionResult
    grade: Grade | None = None
    """None: the gradebook does not have it."""
    known: Mapping[str, str] = field(default_factory=dict)
    """What platforms call the student, by kind, such as `name`, `email`, `canvas_id`."""
    file: str = ""
    """The path under which a platform gave the notebook out; empty if none did."""
    late: bool = False
    """The platform has marked it as late."""
    feedback: Path | None = None
    """The student's page; None: there is none."""


@dataclass
class Export:
    """What an export comes to."""

    content: str | bytes
    left_out: list[str] = field(default_factory=list)
    """Who is not in it, and why, as sentences."""


Format = Callable[[Sequence[Entry], str], Export]
"""Makes an export of entries, sorted by lab and student, and the name of the column in the platform's gradebook."""


def points(number: float) -> str:
    """Return points as every table writes them: at most two decimals, none that say nothing."""
    return f"{round(number, 2):g}"


def scores(entries: Sequence[Entry], left_out: list[str]) -> list[tuple[Entry, str, str]]:
    """Return each entry that has a score, with it and its maximum.

    An undecided submission has no row: an empty cell would take away the score that the platform has.

    Args:
        entries: of one lab.
        left_out: gets a sentence about each that has no score.
    """
    found = []
    for entry in entries:
        if entry.grade is None:
            left_out.append(f"{entry.student} is not in the gradebook: run autograder grade {entry.lab} once more.")
        elif entry.grade.score is None:
            left_out.append(f"{entry.student} has no score yet: a check waits for your verdict in formgrader.")
        else:
            found.append((entry, points(entry.grade.score), points(entry.grade.max_score)))
    return found


def header(entries: Sequence[Entry], column: str) -> str:
    """Return the heading of the column of scores: what was asked for, or the lab's name."""
    return column or entries[0].lab


_FORMULA = ("=", "+", "-", "@", "\t", "\r")
"""What makes a spreadsheet take a text for a formula."""


def table(rows: Iterable[Sequence[str]], quote_all: bool = False) -> str:
    """Return rows as CSV; no text of a student's becomes a formula where somebody opens the file as a spreadsheet."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n", quoting=csv.QUOTE_ALL if quote_all else csv.QUOTE_MINIMAL)
    writer.writerows([[_harmless(cell) for cell in row] for row in rows])
    return text.getvalue()


def _harmless(cell: str) -> str:
    number = cell.removeprefix("-").replace(".", "", 1).isdigit()
    return f"'{cell}" if cell.startswith(_FORMULA) and cell != "-" and not number else cell


_ALWAYS = (1980, 1, 1, 0, 0, 0)
"""Date of every file, so that equal pages give equal zips."""


def feedback_zip(entries: Sequence[Entry], platform: str, place: Callable[[Entry], str]) -> Export:
    """Return the pages of a class in a zip.

    Args:
        entries: of one lab.
        platform: that takes it.
        place: the name of a student's page in it; empty if the platform could not tell whose it is.
    """
    left_out = []
    content = io.BytesIO()
    with zipfile.ZipFile(content, "w", zipfile.ZIP_DEFLATED) as archive:
        for entry in entries:
            name = place(entry)
            if not name:
                left_out.append(
                    f"{entry.student}: {platform} could not tell whose page it is. Grade what it gives out,"
                    " or name its number for the student in roster.csv."
                )
            elif entry.feedback is None:
                left_out.append(f"{entry.student} has no feedback page: run autograder grade {entry.lab} once more.")
            else:
                info = zipfile.ZipInfo(name, _ALWAYS)
                info.compress_type = zipfile.ZIP_DEFLATED
                archive.writestr(info, entry.feedback.read_bytes())
    return Export(content.getvalue(), left_out)
