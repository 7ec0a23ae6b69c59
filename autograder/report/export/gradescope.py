"""Export for Gradescope: results.json. Source: Gradescope's "Autograder Specifications"."""

from __future__ import annotations

import io
import json
import zipfile
from collections.abc import Sequence
from typing import Any

from autograder.core.grades import Grade
from autograder.core.results import CheckResult, Outcome, Status, SubmissionResult
from autograder.report import words
from autograder.report.audience import reason, result_for
from autograder.report.export.entry import Entry, Export


def to_gradescope(entries: Sequence[Entry], _: str) -> Export:
    """Return a zip with `LAB/STUDENT/results.json` for each submission, as a student may see it."""
    content = io.BytesIO()
    with zipfile.ZipFile(content, "w", zipfile.ZIP_DEFLATED) as archive:
        for entry in entries:
            name = f"{entry.lab}/{entry.student}/results.json"
            archive.writestr(zipfile.ZipInfo(name), results_json(entry.result, entry.grade))
    return Export(content.getvalue())


def results_json(full: SubmissionResult, grade: Grade | None = None) -> str:
    """Return the results.json of one submission, as a student may see it.

    Args:
        full: the result of the checks.
        grade: the grade in the gradebook, with points by hand and penalties; None if only the result of the checks
            counts.
    """
    result = result_for(full, "student")
    graded = {cell.grade_id: cell for cell in grade.cells} if grade is not None else {}
    tests = []
    for check in result.checks:
        cell = graded.pop(check.grade_id, None)
        tests.append(_test(check, check.points if cell is None else cell.points))
    for cell in graded.values():
        test: dict[str, Any] = {"name": cell.grade_id, "max_score": cell.max_points, "output": cell.comment}
        test |= {"output": "Not graded yet."} if cell.points is None else {"score": round(cell.points, 2)}
        tests.append(test)
    if grade is not None and grade.penalty:
        tests.append({"name": "Late submission", "score": round(-grade.penalty, 2), "max_score": 0, "output": ""})
    # The total is given explicitly, because Gradescope must not compute a score for an undecided check.
    total = result.points if grade is None else grade.earned
    said = [f"{problem.title}: {reason(problem)}" for problem in result.problems]
    undecided = sum("score" not in test for test in tests)
    if undecided:
        said.append(f"{undecided} of the parts below {'is' if undecided == 1 else 'are'} not graded yet.")
    made = {
        "score": round(total, 2),
        "execution_time": round(result.seconds.get("total", 0.0)),
        "output": "\n".join(said),
        "stdout_visibility": "hidden",
        "tests": tests,
        "extra_data": {"lab": result.lab, "isolation": result.isolation.value, "seed": result.seed},
    }
    return json.dumps(made, indent=1) + "\n"


def _test(check: CheckResult, earned: float | None) -> dict[str, Any]:
    test: dict[str, Any] = {"name": check.title or check.grade_id, "max_score": check.max_points}
    said = [_text(outcome) for outcome in check.outcomes if outcome.status in (Status.FAILED, Status.UNKNOWN)]
    left = words.findings(check).not_looked_at
    test["output"] = "\n\n".join([*said, left] if left else said)
    if earned is not None:
        test["score"] = round(earned, 2)
        test["status"] = "passed" if earned >= check.max_points else "failed"
    else:
        test["output"] = f"{words.points(check)}\n\n{test['output']}"
    return test


def _text(outcome: Outcome) -> str:
    pairs = ("expected", outcome.expected), ("observed", outcome.observed), ("because", outcome.because)
    lines = [f"{outcome.status.value}: {outcome.title}"]
    return "\n".join([*lines, *(f"  {label}: {text}" for label, text in (*pairs, ("try", outcome.hint)) if text)])
