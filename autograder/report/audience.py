"""Who reads a report: a student sees of a hidden test that it failed and where to read on, and nothing else."""

from __future__ import annotations

from typing import Literal, TypeVar

from autograder.core.results import CellResult, Outcome, Status, SubmissionResult
from autograder.reasons import Group, Kind

HIDDEN = Kind("hidden", "a check that students do not see failed; they are told no more than that", Group.OUTPUT)

Audience = Literal["student", "instructor"]
_Result = TypeVar("_Result", bound=CellResult)

_HIDDEN_TITLE = {
    Status.PASSED: "A hidden check passed",
    Status.FAILED: "A hidden check failed",
    Status.NOT_CHECKED: "A hidden check was not looked at",
    Status.UNKNOWN: "A hidden check could not be decided",
}


def outcome_for(outcome: Outcome, audience: Audience) -> Outcome:
    """Return what this audience may know of an outcome."""
    if audience == "instructor" or not outcome.hidden:
        return outcome
    return Outcome(
        status=outcome.status, title=_HIDDEN_TITLE[outcome.status], hint=outcome.hint, code=HIDDEN.code, hidden=True
    )


def check_for(check: _Result, audience: Audience) -> _Result:
    """Return what this audience may know of a check."""
    flags = check.flags if audience == "instructor" else []
    shown = [outcome_for(outcome, audience) for outcome in check.outcomes]
    return check.model_copy(update={"outcomes": shown, "flags": flags})


def result_for(result: SubmissionResult, audience: Audience) -> SubmissionResult:
    """Return what this audience may know of a submission's result."""
    return result.model_copy(update={"checks": [check_for(check, audience) for check in result.checks]})


def reason(outcome: Outcome) -> str:
    """Why an outcome is what it is, in one line."""
    text = outcome.because or (f"{outcome.title}: {outcome.observed}" if outcome.observed else outcome.title)
    return " ".join(text.split())
