"""Decide what the reader of a report may see. Of a hidden test, a student sees only the verdict and the hint."""

from __future__ import annotations

from typing import Literal, TypeVar

from autograder.core.results import CellResult, Outcome, Status, SubmissionResult
from autograder.reasons import Group, Kind

HIDDEN = Kind("hidden", "a check that students do not see failed; they get no further details", Group.OUTPUT)

Audience = Literal["student", "instructor"]
_Result = TypeVar("_Result", bound=CellResult)

_HIDDEN_TITLE = {
    Status.PASSED: "A hidden check passed",
    Status.FAILED: "A hidden check failed",
    Status.NOT_CHECKED: "A hidden check was not run",
    Status.UNKNOWN: "A hidden check could not be decided",
}


def outcome_for(outcome: Outcome, audience: Audience) -> Outcome:
    """Return the part of an outcome that this audience may see."""
    if audience == "instructor" or not outcome.hidden:
        return outcome
    return Outcome(
        status=outcome.status, title=_HIDDEN_TITLE[outcome.status], hint=outcome.hint, code=HIDDEN.code, hidden=True
    )


def check_for(check: _Result, audience: Audience) -> _Result:
    """Return the part of a check's result that this audience may see."""
    flags = check.flags if audience == "instructor" else []
    varied = check.varied if audience == "instructor" else []  # hidden tests draw some of them
    logs = [log for log in check.logs if audience == "instructor" or not log.hidden]
    shown = [outcome_for(outcome, audience) for outcome in check.outcomes]
    return check.model_copy(update={"outcomes": shown, "flags": flags, "varied": varied, "logs": logs})


def result_for(result: SubmissionResult, audience: Audience) -> SubmissionResult:
    """Return the part of a submission's result that this audience may see."""
    return result.model_copy(update={"checks": [check_for(check, audience) for check in result.checks]})


def reason(outcome: Outcome) -> str:
    """Return the reason for an outcome in one line."""
    text = outcome.because or (f"{outcome.title}: {outcome.observed}" if outcome.observed else outcome.title)
    return " ".join(text.split())
