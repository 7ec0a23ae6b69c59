"""Blackboard's Grade Center: the table that "Work Offline" uploads.

Source: Blackboard's help, "Upload or download grade items": a student is found by user name, a column by its id.
"""

from __future__ import annotations

from collections.abc import Sequence

from autograder.report.export.entry import Entry, Export, header, scores, table


def to_blackboard(entries: Sequence[Entry], column: str) -> Export:
    """Return the table, with every cell in quotes, as Blackboard wants it of commas.

    A column that exists is named as Blackboard's own download names it, `Lab 2 [Total Pts: 29 Score] |4711`; another
    name makes a new column of text, which has to be turned into one of scores.
    """
    left_out: list[str] = []
    rows = [("Last Name", "First Name", "Username", header(entries, column))]
    for entry, score, _ in scores(entries, left_out):
        first, last = _names(entry.known.get("name", ""))
        user = entry.known.get("blackboard") or entry.known.get("id") or entry.student
        rows.append((last, first, user, score))
    return Export(table(rows, quote_all=True), left_out)


def _names(name: str) -> tuple[str, str]:
    """First and last name, of `Doe, Jane` or `Jane Doe`."""
    last, comma, first = name.partition(",")
    if not comma:
        first, _, last = name.rpartition(" ")
    return first.strip(), last.strip()
