"""Exports for Canvas: the CSV file that its gradebook imports, and the zip of feedback that an assignment accepts.

Sources: Canvas's guide to importing grades, and `lib/gradebook_importer.rb` and `infer_comment_context_from_filename`
of its published source.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import PurePosixPath

from autograder.report.export.entry import Entry, Export, feedback_zip, header, scores, table


def to_canvas(entries: Sequence[Entry], column: str) -> Export:
    """Return the table for Canvas, which finds a student by `ID`, then by SIS user id or login, then by name.

    To fill an existing column, use the name from Canvas's own export, `Lab 2 (4711)`. With any other name, Canvas
    creates a new assignment.
    """
    left_out: list[str] = []
    found = scores(entries, left_out)
    top = max((most for _, _, most in found), key=float, default="0")
    rows = [("Student", "ID", "SIS User ID", "SIS Login ID", "Section", header(entries, column))]
    rows.append(("    Points Possible", "", "", "", "", top))
    for entry, score, _ in found:
        known = entry.known
        login = known.get("canvas_login") or known.get("email", "")
        name = known.get("name") or entry.student
        number = known.get("canvas_id", "")
        # If Canvas's number is known but there is no roster, the name here is the one that Canvas made up for a file.
        sis = known.get("id") or ("" if number else entry.student)
        rows.append((name, number, sis, login, known.get("section", ""), score))
    return Export(table(rows), left_out)


def to_canvas_feedback(entries: Sequence[Entry], _: str) -> Export:
    """Return the zip for "Upload submissions". Canvas finds the user and the upload by the names from its download."""
    return feedback_zip(entries, "Canvas", _place)


def _place(entry: Entry) -> str:
    """Return the name for a feedback page, made from Canvas's name for the upload; empty if that name is not known.

    The upload is a notebook, or a zip with a notebook in it.
    """
    number = entry.known.get("canvas_id")
    given = (part for part in reversed(PurePosixPath(entry.file).parts) if number and f"_{number}_" in part)
    return next((f"{part.removesuffix('.ipynb')}.html" for part in given), "")
