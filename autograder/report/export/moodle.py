"""Exports for a Moodle assignment: the offline grading worksheet, and the zip of feedback files.

Sources: Moodle's documentation of both, and `importgradeslib.php` and `importziplib.php` of its published source.
"""

from __future__ import annotations

import datetime
import re
from collections.abc import Sequence

from autograder.report.export.entry import Entry, Export, feedback_zip, scores, table

_COLUMNS = (
    "Identifier", "Full name", "Email address", "Grade", "Maximum Grade", "Last modified (grade)", "Feedback comments",
)  # fmt: skip

_GIVEN = re.compile(r".+_\d+_assignsubmission_[a-z]+_?")


def to_moodle(entries: Sequence[Entry], _: str) -> Export:
    """Return the worksheet, in which Moodle finds a student by `Identifier`.

    The identifier ends in the number from the zip of submissions. Moodle skips a grade that was changed in Moodle after
    the time in the worksheet, which is the time of the export.
    """
    left_out: list[str] = []
    now = datetime.datetime.now(datetime.UTC)
    changed = f"{now:%A}, {now.day} {now:%B %Y}, {now:%I:%M %p} UTC"
    rows: list[tuple[str, ...]] = [_COLUMNS]
    for entry, score, most in scores(entries, left_out):
        number = entry.known.get("moodle_id", "")
        if not number:
            left_out.append(f"{entry.student} has no `moodle_id`: grade Moodle's zip, or add it to roster.csv.")
            continue
        grade = entry.grade
        comments = [cell.comment for cell in grade.cells if cell.comment] if grade is not None else []
        comments += [grade.told_waiting] if grade is not None and grade.waiting else []
        name, email = entry.known.get("name") or entry.student, entry.known.get("email", "")
        rows.append((f"Participant {number}", name, email, score, most, changed, "\n".join(comments)))
    return Export(table(rows), left_out)


def to_moodle_feedback(entries: Sequence[Entry], _: str) -> Export:
    """Return the zip for "Upload multiple feedback files in a zip", with folders as in the zip of submissions."""
    return feedback_zip(entries, "Moodle", _place)


def _place(entry: Entry) -> str:
    number = entry.known.get("moodle_id", "")
    # If Moodle exported files without folders, the text before the files' own names is the folder's name.
    given = next(filter(None, map(_GIVEN.match, entry.file.split("/"))), None)
    name = (entry.known.get("name") or entry.student).replace("_", " ").replace("/", " ")
    folder = given[0] if given else (f"{name}_{number}_assignsubmission_file" if number else "")
    return f"{folder}/{entry.lab}.html" if folder else ""
