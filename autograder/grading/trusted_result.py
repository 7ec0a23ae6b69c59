"""What is believed of a result: only what belongs to the job, check by check. The rest is undecided.

A result comes from a worker that was close to a student's programs, or from a file: neither decides how many points a
check has.

Checks are run again, alone, where others kept their programs from the CPUs when something was decided against them.
Whose CPU it was is known (`autograder.core.cpu_use`), so a program cannot bring this about by computing on and on. What
others do costs time and no points: with nothing else of this kit beside it a check either comes to a verdict, whatever
that is, or nobody could find out.
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
"""As much of what the worker printed last is kept."""


def validated(result: SubmissionResult, checks: Sequence[Cell]) -> SubmissionResult:
    """Return the result with exactly the lab's checks; one that is missing or impossible is undecided."""
    by_id = {check.grade_id: check for check in result.checks}
    return result.model_copy(update={"checks": [believed(cell, by_id.get(cell.grade_id)) for cell in checks]})


def believed(cell: Cell, check: CheckResult | None) -> CheckResult:
    """Return what is believed of one check's result: it is undecided if there is none, or an impossible one."""
    possible = check is not None and (check.points is None or 0.0 <= check.points <= check.max_points)
    if check is None or not possible or check.max_points != cell.points:
        check = undecided(cell, "The grader returned no usable result for this check.")
    return check.model_copy(update={"title": cell.title})


def undecided(cell: Cell, because: str, printed: str = "", kind: Kind = NO_RESULT) -> CheckResult:
    """Return the result of a check that nobody could decide.

    Args:
        cell: the check.
        because: why, as a sentence.
        printed: what the worker printed.
        kind: of the reason.
    """
    outcome = Outcome(
        status=Status.UNKNOWN,
        title="the grader finished this check",
        because=because,
        observed="\n".join(printed.strip().splitlines()[-_LINES:])[-_CHARACTERS:],
        hint="No points are taken. Your instructor decides.",
        code=kind.code,
    )
    return all_for_one_reason(cell, outcome, points=None)


def too_busy(cell: Cell, seconds: float) -> CheckResult:
    """Return the result of a check whose programs others kept from the CPUs for so many seconds, alone as well."""
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
    """Whether the grading process, or the machine, kept back a result, which says nothing about the submission.

    What was decided stands, and so does a check at which the worker got stuck or died twice: the same programs would
    bring it about again, and a person has to look.
    """
    return any(outcome.code in (NO_RESULT.code, TOO_BUSY.code) for check in result.checks for outcome in check.outcomes)


def was_killed(check: CheckResult) -> bool:
    """Whether it failed because a program got a signal that no program can help, and that the kit did not send.

    The system sends it when memory runs out, and then takes any process; a program that sends it to itself will do so
    when it is tried once more.
    """
    failure = check.first_failure
    ends = [log.exit_status for log in check.logs if not log.stopped_by]
    return failure is not None and failure.code == "crashed" and -signal.SIGKILL in ends


def is_open(check: CheckResult) -> bool:
    """Whether a check lost points, or a verdict, in a time in which its programs had no chance to run."""
    return check.starved > 0 and (check.points is None or check.points < check.max_points)


def open_checks(job: Job, result: SubmissionResult) -> Job | None:
    """Return the job that runs the open checks of a result again, alone; None if it has none."""
    wanted = {check.grade_id for check in result.checks if is_open(check)}
    cells = [cell for cell in job.cells if cell.points is None or cell.grade_id in wanted]
    return job.model_copy(update={"cells": cells, "alone": True, "seed": result.seed}) if wanted else None


def settled(job: Job, first: SubmissionResult, again: SubmissionResult) -> SubmissionResult:
    """Return a result with what its open checks came to when they were run again, alone.

    Args:
        job: of the second run.
        first: the result of the first run.
        again: the result of the second.
    """
    cells = {cell.grade_id: cell for cell in job.checks}
    before = {check.grade_id: check for check in first.checks}
    second = {one.grade_id: _settled(cells[one.grade_id], before[one.grade_id], one) for one in again.checks}
    seconds = {name: round(first.seconds.get(name, 0.0) + spent, 3) for name, spent in again.seconds.items()}
    checks = [second.get(check.grade_id, check) for check in first.checks]
    return first.model_copy(update={"checks": checks, "seconds": seconds})


def _settled(cell: Cell, first: CheckResult, again: CheckResult) -> CheckResult:
    """What a check came to, with all that a person may want to see of both runs."""
    check = again
    if is_open(again):
        busy = too_busy(cell, again.starved)
        check = busy.model_copy(
            update={"seconds": again.seconds, "outcomes": [*busy.outcomes, *again.outcomes], "logs": again.logs}
        )
    flags = list(dict.fromkeys([*first.flags, *again.flags]))
    return check.model_copy(update={"run_again": True, "flags": flags, "logs": check.logs or first.logs})
