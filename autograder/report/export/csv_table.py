"""A table: a row for each check of each submission."""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence

from autograder.core.results import SubmissionResult


def to_csv(results: Sequence[SubmissionResult]) -> str:
    """Return a row for each check; the points of a check that nobody could decide stay empty."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(("student", "lab", "check", "points", "max_points", "status", "reason"))
    for result in results:
        for check in result.checks:
            failure = check.first_failure
            points = "" if check.points is None else f"{check.points:g}"
            writer.writerow(
                (
                    result.student,
                    result.lab,
                    check.grade_id,
                    points,
                    f"{check.max_points:g}",
                    check.status.value,
                    failure.code if failure else "",
                )
            )
    return text.getvalue()
