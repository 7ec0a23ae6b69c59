"""The common parts of exports: the submissions with the platforms' names, CSV tables, and zips of feedback."""

from __future__ import annotations

import csv
import io
import zipfile
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from autograder.core.grades import Grade
from autograder.core.history import Entry as HistoryEntry
from autograder.core.results import SubmissionResult


@dataclass(frozen=True)
class Entry:
    """A submission with everything that an export may need."""

    student: str
    lab: str
    result: SubmissionResult
    grade: Grade | None = None
    """The grade; None if the gradebook does not have the submission."""
    known: Mapping[str, str] = field(default_factory=dict)
    """The student's names on platforms, by kind, such as `name`, `email`, `canvas_id`."""
    file: str = ""
    """The path of the notebook in the platform's download; empty if it did not come from a platform."""
    late: bool = False
    """Whether the platform has marked the submission as late."""
    feedback: Path | None = None
    """The student's feedback page; None if there is none."""
    history: Sequence[HistoryEntry] = ()
    """What happened to the points, the oldest entry first."""
    stale: bool = False
    """Whether the result or the feedback page is not the one to which the grade belongs."""


@dataclass
class Export:
    """An export, and the students who are not in it."""

    content: str | bytes
    left_out: list[str] = field(default_factory=list)
    """Sentences about the students who are not in the export, with the reasons."""


Format = Callable[[Sequence[Entry], str], Export]
"""A function that makes an export from entries, which are sorted by lab and student, and the name of the column in the
platform's gradebook."""


def points(number: float) -> str:
    """Return points in the form of all tables: with at most two decimals and no trailing zeros."""
    return f"{round(number, 2):g}"


def scores(entries: Sequence[Entry], left_out: list[str]) -> list[tuple[Entry, str, str]]:
    """Return each entry that has a score, with its score and its maximum.

    An undecided submission is left out, because an empty cell would delete the score that the platform already has.

    Args:
        entries: the submissions of one lab.
        left_out: a list to which a sentence is added for each submission without a score.
    """
    found = []
    for entry in entries:
        if entry.grade is None:
            left_out.append(
                f"{entry.student} is not in the gradebook: run autograder grade {entry.lab} SUBMISSIONS again."
            )
        elif entry.stale:
            left_out.append(told_stale(entry))
        elif entry.grade.score is None:
            left_out.append(
                f"{entry.student} has no score yet, because the grader could not decide a check: grade the lab again,"
                " or decide in formgrader."
            )
        else:
            found.append((entry, points(entry.grade.score), points(entry.grade.max_score)))
    return found


def told_stale(entry: Entry) -> str:
    """Say that a student is not exported because the result, the grade and the page do not belong together."""
    return (
        f"{entry.student}: the result, the grade and the feedback page do not belong together, because something"
        f" changed after {entry.lab} was graded: run autograder grade {entry.lab} SUBMISSIONS again."
    )


def header(entries: Sequence[Entry], column: str) -> str:
    """Return the heading for the column of scores: the name that was asked for, or else the lab's name."""
    return column or entries[0].lab


_FORMULA = ("=", "+", "-", "@", "\t", "\r")
"""The characters with which a formula in a spreadsheet can begin."""


def table(rows: Iterable[Sequence[str]], quote_all: bool = False) -> str:
    """Return rows as CSV in which no text of a student can become a formula when a spreadsheet opens the file."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n", quoting=csv.QUOTE_ALL if quote_all else csv.QUOTE_MINIMAL)
    writer.writerows([[_harmless(cell) for cell in row] for row in rows])
    return text.getvalue()


def _harmless(cell: str) -> str:
    number = cell.removeprefix("-").replace(".", "", 1).isdigit()
    return f"'{cell}" if cell.startswith(_FORMULA) and cell != "-" and not number else cell


_ALWAYS = (1980, 1, 1, 0, 0, 0)
"""The date of every file in a zip. It is always the same, so that equal pages give equal zips."""


def feedback_zip(entries: Sequence[Entry], platform: str, place: Callable[[Entry], str]) -> Export:
    """Return a zip with the feedback pages of a class.

    Args:
        entries: the submissions of one lab.
        platform: the platform that will read the zip.
        place: a function that returns the name of a student's page in the zip; empty if the platform could not assign
            the page to the student.
    """
    left_out = []
    content = io.BytesIO()
    with zipfile.ZipFile(content, "w", zipfile.ZIP_DEFLATED) as archive:
        for entry in entries:
            name = place(entry)
            if not name:
                left_out.append(
                    f"{entry.student}: {platform} could not assign the page to a student. Grade the submissions as"
                    f" {platform} exports them, or put its number for the student into roster.csv."
                )
            elif entry.stale:
                left_out.append(told_stale(entry))
            elif entry.feedback is None:
                left_out.append(
                    f"{entry.student} has no feedback page: run autograder grade {entry.lab} SUBMISSIONS again."
                )
            else:
                info = zipfile.ZipInfo(name, _ALWAYS)
                info.compress_type = zipfile.ZIP_DEFLATED
                archive.writestr(info, entry.feedback.read_bytes())
    return Export(content.getvalue(), left_out)
