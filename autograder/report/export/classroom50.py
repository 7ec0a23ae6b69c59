"""Export for Classroom 50: the result.json that an assignment's autograder.py has to write.

Source: Classroom 50's wiki, "Advanced Autograding", and its schema `classroom50/result/v1`.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from datetime import UTC, datetime

from autograder.core.errors import KitError
from autograder.core.results import SubmissionResult
from autograder.report import words
from autograder.report.audience import result_for

_GIVEN = {
    "classroom": "CLASSROOM",
    "assignment": "ASSIGNMENT",
    "submission": "SUBMISSION_TAG",
    "commit": "COMMIT_URL",
    "release": "RELEASE_URL",
    "review": "REVIEW_URL",
}
"""What Classroom 50's runner says in environment variables, and result.json repeats."""
PARTS = 100
"""Classroom 50 counts in whole numbers, so points are told in hundredths."""


def result_json(full: SubmissionResult, environment: Mapping[str, str]) -> str:
    """Return the result.json of one submission, as a student may see it. Its scores are hundredths of a point.

    A check that has passed so far counts in full here, also if hidden tests at grading decide about its points; its
    `output` says so.

    Args:
        full: the result of the checks. None of them may be undecided, because result.json cannot say so.
        environment: the variables that Classroom 50's runner sets.

    Raises:
        KitError: a variable is missing, or a check is undecided.
    """
    said = {key: environment.get(name, "") for key, name in _GIVEN.items()}
    said["review"] = said["review"] or said["commit"]  # older runners do not say it
    missing = [_GIVEN[key] for key, value in said.items() if not value]
    if missing:
        what = f"result.json is written for Classroom 50, and its runner did not set {', '.join(missing)}."
        raise KitError(what, "Leave --classroom50 out elsewhere.")
    result = result_for(full, "student")
    undecided = [check.title or check.grade_id for check in result.checks if check.points is None]
    if undecided:
        raise KitError(
            f"The grader could not find out about {', '.join(undecided)}, and result.json cannot say so.",
            "Let Classroom 50 run this submission again.",
        )
    tests = [
        {
            "test-name": check.title or check.grade_id,
            "passed": (earned := check.points or 0.0) >= check.max_points,
            "score": round(earned * PARTS),
            "max-score": round(check.max_points * PARTS),
            "output": words.points(check),
        }
        for check in result.checks
    ]
    made = {
        "schema": "classroom50/result/v1",
        **said,
        "datetime": datetime.now(UTC).strftime("%Y-%m-%dT%H:%M:%SZ"),
        "score": sum(int(str(test["score"])) for test in tests),
        "max-score": sum(int(str(test["max-score"])) for test in tests),
        "tests": tests,
    }
    return json.dumps(made, indent=1) + "\n"
