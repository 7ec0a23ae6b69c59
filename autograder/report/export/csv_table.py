"""Export a table with a row for each graded cell of each submission. The points of a submission add up to its score."""

from __future__ import annotations

from collections.abc import Sequence

from autograder.report.export.entry import Entry, Export, points, table


def to_csv(entries: Sequence[Entry], _: str) -> Export:
    """Return the table. Points that have not been decided yet are empty."""
    rows: list[tuple[str, ...]] = [("student", "lab", "check", "points", "max_points", "status", "reason")]
    for entry in entries:
        graded = {cell.grade_id: cell for cell in entry.grade.cells} if entry.grade is not None else {}
        for check in entry.result.checks:
            cell = graded.pop(check.grade_id, None)
            earned = check.points if cell is None else cell.points
            failure = check.first_failure
            row = (
                points_or_empty(earned),
                points(check.max_points),
                check.status.value,
                failure.code if failure else "",
            )
            rows.append((entry.student, entry.lab, check.grade_id, *row))
        for cell in graded.values():
            status = "waiting" if cell.points is None else "by hand" if cell.by_hand else "not answered"
            row = (points_or_empty(cell.points), points(cell.max_points), status, "")
            rows.append((entry.student, entry.lab, cell.grade_id, *row))
        if entry.grade is not None and entry.grade.penalty:
            row = (points(-entry.grade.penalty), "0", "late", "")
            rows.append((entry.student, entry.lab, "late submission", *row))
    return Export(table(rows))


def points_or_empty(number: float | None) -> str:
    """Return points as text; empty if they have not been decided yet."""
    return "" if number is None else points(number)
