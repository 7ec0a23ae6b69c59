"""Results for other programs: CSV, JUnit, and Gradescope's JSON."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Sequence

from autograder.core.results import Status, SubmissionResult
from autograder.report.audience import reason, result_for
from autograder.report.junit import junit_xml


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


def to_junit(results: Sequence[SubmissionResult]) -> str:
    """Return JUnit XML as a student may see it."""
    return junit_xml(results, "student")


def to_gradescope(results: Sequence[SubmissionResult]) -> str:
    """Return Gradescope's results.json by student, as a student may see it; an undecided check has no score."""
    by_student = {}
    for full in results:
        result = result_for(full, "student")
        tests = []
        for check in result.checks:
            bad = [outcome for outcome in check.outcomes if outcome.status is not Status.PASSED]
            test = {
                "name": check.title or check.grade_id,
                "max_score": check.max_points,
                "status": "passed" if check.status is Status.PASSED else "failed",
                "output": "\n".join(f"{outcome.status.value}: {reason(outcome)}" for outcome in bad),
            }
            if check.points is not None:
                test["score"] = check.points
            tests.append(test)
        by_student[f"{result.student}/{result.lab}"] = {"tests": tests}
    return json.dumps(by_student, indent=1) + "\n"


FORMATS = {"csv": to_csv, "junit": to_junit, "gradescope": to_gradescope}
