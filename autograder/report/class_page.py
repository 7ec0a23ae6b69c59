"""The class report: one page with how each check went, why it failed most often, and who stands where."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from pathlib import Path

from autograder.core.files import write_beside
from autograder.core.results import CheckResult, Status, SubmissionResult
from autograder.report.audience import reason
from autograder.report.html import render
from autograder.report.terminal import class_status, why_lost

_REASONS = 5


def _check_row(checks: Sequence[CheckResult]) -> dict[str, object]:
    reasons: Counter[str] = Counter()
    example: dict[str, str] = {}
    for check in checks:
        failure = check.first_failure
        if failure is not None:
            code = failure.code or "other"
            reasons[code] += 1
            example.setdefault(code, reason(failure))
    passed = sum(check.status is Status.PASSED for check in checks)
    return {
        "title": checks[0].title or checks[0].grade_id,
        "max_points": checks[0].max_points,
        "passed": passed,
        "count": len(checks),
        "percent": round(100 * passed / len(checks)),
        "reasons": [(number, code, example[code]) for code, number in reasons.most_common(_REASONS)],
    }


def write_class_page(path: Path, results: Sequence[SubmissionResult]) -> Path:
    """Write the page to `path` and return that."""
    labs = []
    for lab in sorted({result.lab for result in results}):
        of_lab = [result for result in results if result.lab == lab]
        by_id: dict[str, list[CheckResult]] = {}
        for result in of_lab:
            for check in result.checks:
                by_id.setdefault(check.grade_id, []).append(check)
        students = [{"result": result, "status": class_status(result), "why": why_lost(result)} for result in of_lab]
        labs.append({"name": lab, "checks": [_check_row(checks) for checks in by_id.values()], "students": students})
    write_beside(path, render("class.html", labs=labs))
    return path
