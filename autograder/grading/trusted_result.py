"""Decide which parts of a result can be trusted: those that fit the job's checks. All other checks are undecided.

A result comes from a worker that ran close to a student's programs, or from a file. Neither of them decides how many
points a check can give.

A check is run again if it lost points while other processes kept its programs from the CPUs. It is known which
processes used the CPUs (`autograder.core.cpu_use`), so a program cannot cause this by computing all the time. Other
processes therefore cost only time and no points. In the last run of a check, nothing else of this kit runs at the same
time, and the check either gets a verdict or stays undecided.
"""

from __future__ import annotations

import signal
from collections.abc import Sequence

from autograder.core.results import CheckResult, Outcome, Status, SubmissionResult
from autograder.course.lab import Cell
from autograder.grading.job import Job
from autograder.reasons import Group, Kind

NO_RESULT = Kind("no-result", "the grader said nothing about this check; an instructor decides", Group.GRADER)
TOO_BUSY = Kind(
    "too-busy", "the machine was too busy, also when the check was run again alone; an instructor decides", Group.GRADER
)

_LINES, _CHARACTERS = 7, 1000
"""The number of lines and characters that are kept from the end of the worker's output."""


def validated(result: SubmissionResult, checks: Sequence[Cell]) -> SubmissionResult:
    """Return the result with exactly the lab's checks. A check that is missing or impossible is undecided."""
    by_id = {check.grade_id: check for check in result.checks}
    return result.model_copy(update={"checks": [believed(cell, by_id.get(cell.grade_id)) for cell in checks]})


def believed(cell: Cell, check: CheckResult | None) -> CheckResult:
    """Return the result of one check if it is possible; if it is missing or impossible, return an undecided result."""
    possible = check is not None and (check.points is None or 0.0 <= check.points <= check.max_points)
    if check is None or not possible or check.max_points != cell.points:
        check = undecided(cell, "The grader returned no usable result for this check.")
    return check.model_copy(update={"title": cell.title})


def undecided(cell: Cell, because: str, printed: str = "", kind: Kind = NO_RESULT) -> CheckResult:
    """Return an undecided result for a check.

    Args:
        cell: the check.
        because: the reason, as a sentence.
        printed: the worker's output.
        kind: the kind of the reason.
    """
    outcome = Outcome(
        status=Status.UNKNOWN,
        title="the grader finished this check",
        because=because,
        observed="\n".join(printed.strip().splitlines()[-_LINES:])[-_CHARACTERS:],
        hint="No points are taken off. Your instructor decides.",
        code=kind.code,
    )
    return all_for_one_reason(cell, outcome, points=None)


def too_busy(cell: Cell, seconds: float) -> CheckResult:
    """Return the result of a check whose programs were kept from the CPUs for some seconds even when it ran alone."""
    because = (
        f"Even when the check was run again alone, other processes kept its programs from the CPU for {seconds:.1f} s"
        " of the time in which it was decided. Run it again when the machine has less to do."
    )
    return undecided(cell, because, kind=TOO_BUSY)


def all_for_one_reason(cell: Cell, outcome: Outcome, points: float | None) -> CheckResult:
    """Return a check's result that consists of one outcome."""
    return CheckResult(
        grade_id=cell.grade_id, title=cell.title, max_points=cell.points or 0.0, points=points, outcomes=[outcome]
    )


def lacks_a_result(result: SubmissionResult) -> bool:
    """Return whether a check has no result because of the grading process or the machine, so that it should run again.

    A check that was decided is not run again, and neither is a check at which the worker got stuck or died twice. The
    same programs would cause this again, so a person has to look at them.
    """
    return any(outcome.code in (NO_RESULT.code, TOO_BUSY.code) for check in result.checks for outcome in check.outcomes)


def was_too_busy(check: CheckResult) -> bool:
    """Return whether a check is undecided because the machine was too busy, also when the check ran again alone."""
    return check.points is None and any(outcome.code == TOO_BUSY.code for outcome in check.outcomes)


def needs_another_try(check: CheckResult) -> bool:
    """Return whether a check failed because of something that the system or the middleware can cause, too.

    This is a program that was ended by SIGKILL, which the kit did not send: the system sends this signal to any process
    when memory runs out. Or it is a node that a program has made and that is not on the graph: very rarely, Fast DDS
    does not deliver its name. A program that causes either of the two itself will do so again when the check is tried a
    second time.
    """
    failure = check.first_failure
    ends = [log.exit_status for log in check.logs if not log.stopped_by]
    return failure is not None and (
        failure.code == "not-on-graph" or (failure.code == "crashed" and -signal.SIGKILL in ends)
    )


def is_open(check: CheckResult) -> bool:
    """Return whether a check lost points or has no verdict because its programs had no chance to run for some time."""
    return check.starved > 0 and (check.points is None or check.points < check.max_points)


def has_open_checks(result: SubmissionResult) -> bool:
    """Return whether a check of a result is open, so that it has to be run again."""
    return any(map(is_open, result.checks))


def to_run_again(job: Job, result: SubmissionResult, *, alone: bool) -> Job:
    """Return the job that runs the open checks of a result again, alone or not."""
    wanted = {check.grade_id for check in result.checks if is_open(check)}
    cells = [cell for cell in job.cells if cell.points is None or cell.grade_id in wanted]
    return job.model_copy(update={"cells": cells, "alone": alone, "seed": result.seed})


def settled(job: Job, first: SubmissionResult, again: SubmissionResult) -> SubmissionResult:
    """Return a result with the results that its open checks had when they were run again.

    If they ran beside others, a check is still open unless it got all points or lost the same ones for the same reason
    again. If they ran alone, what is open then remains undecided.

    Args:
        job: the job that ran them again.
        first: the result before that.
        again: the result of that run.
    """
    cells = {cell.grade_id: cell for cell in job.checks}
    before = {check.grade_id: check for check in first.checks}
    second = {one.grade_id: _settled(cells[one.grade_id], before[one.grade_id], one, job.alone) for one in again.checks}
    seconds = {name: round(first.seconds.get(name, 0.0) + spent, 3) for name, spent in again.seconds.items()}
    checks = [second.get(check.grade_id, check) for check in first.checks]
    return first.model_copy(update={"checks": checks, "seconds": seconds})


def _lost_the_same(first: CheckResult, again: CheckResult) -> bool:
    """Return whether both runs of a check lost the same points for the same reason."""
    codes = {failure.code for failure in (first.first_failure, again.first_failure) if failure is not None}
    return first.points == again.points and len(codes) < 2


def _settled(cell: Cell, first: CheckResult, again: CheckResult, alone: bool) -> CheckResult:
    """Return the result of a check that was run again, with everything that a person may want to see from all runs."""
    check = again
    if not alone and not (is_open(again) or again.points == again.max_points or _lost_the_same(first, again)):
        check = again.model_copy(update={"starved": first.starved})  # it remains open
    if alone and is_open(again):
        busy = too_busy(cell, again.starved)
        check = busy.model_copy(
            update={"seconds": again.seconds, "outcomes": [*busy.outcomes, *again.outcomes], "logs": again.logs}
        )
    flags = list(dict.fromkeys([*first.flags, *again.flags]))
    return check.model_copy(update={"run_again": True, "flags": flags, "logs": check.logs or first.logs})
