"""Checks that are run again, alone: others kept their programs from the CPUs when something was decided against them.

Whose CPU it was is known (`autograder.core.cpu_use`), so a program cannot bring this about by computing on and on. What
others do costs time and no points: with nothing else of this kit beside it a check either comes to a verdict, whatever
that is, or nobody could find out.
"""

from __future__ import annotations

from autograder.core.results import CheckResult, SubmissionResult
from autograder.course.lab import Cell
from autograder.grading.job import Job
from autograder.grading.validation import too_busy


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
