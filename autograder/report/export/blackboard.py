"""Export for Blackboard's Grade Center: the table that "Work Offline" uploads.

Source: Blackboard's help, "Upload or download grade items". Students are found by user name, and columns by their id.
"""

from __future__ import annotations

from collections.abc import Sequence

from autograder.report.export.entry import Entry, Export, header, scores, table


def to_blackboard(entries: Sequence[Entry], column: str) -> Export:
    """Return the table with every cell in quotes, as Blackboard requires if cells are separated by commas.

    To fill an existing column, use the name from Blackboard's own download, `Lab 2 [Total Pts: 29 Score] |4711`. With
    any other name, Blackboard creates a new text column, which has to be changed into a column of scores there.
    """
    left_out: list[str] = []
    rows = [("Last Name", "First Name", "Username", header(entries, column))]
    for entry, score, _ in scores(entries, left_out):
        first, last = _names(entry.known.get("name", ""))
        user = entry.known.get("blackboard") or entry.known.get("id") or entry.student
        rows.append((last, first, user, score))
    return Export(table(rows, quote_all=True), left_out)


def _names(name: str) -> tuple[str, str]:
    """Split `Doe, Jane` or `Jane Doe` into the first and the last name."""
    last, comma, first = name.partition(",")
    if not comma:
        first, _, last = name.rpartition(" ")
    return first.strip(), last.strip()
