"""Gradescope's results.json."""

from __future__ import annotations

import json
from collections.abc import Sequence

from autograder.core.results import Status, SubmissionResult
from autograder.report.audience import reason, result_for


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
