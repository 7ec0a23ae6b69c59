"""Runs the grading worker on one job. What becomes of the worker costs at most the check that it was at."""

from __future__ import annotations

import threading

from pydantic import ValidationError

from autograder.grading.job import CELL_SECONDS, STUCK_SECONDS, Cell, Job
from autograder.results import CheckResult, Outcome, Status, SubmissionResult
from autograder.sandbox.outer import OuterRun, run_in_sandbox

SECONDS_PER_CHECK = 30.0
"""Seconds that each check may take on average; besides, one of them may get stuck."""
LOST = 2
"""Checks that a submission may lose to a worker; then the rest of them is given up, too."""
NO_RESULT = "no-result"
"""The reason code of a check at which the worker died, or about which it said nothing."""
STUCK = "stuck"
"""The reason code of a check at which the worker got stuck."""
_LINES = 6
"""Lines that are kept of what a worker said at its end."""
_STACKS = b"\nTimeout ("
"""How the stacks begin that the worker writes when it is stuck; no text in a line of JSON holds the end of a line."""


def run_in_worker(job: Job, stop: threading.Event | None = None) -> SubmissionResult:
    """Run a job's checks in the sandbox. What each one comes to is kept as soon as it is known.

    At a check at which the worker gets stuck, nobody could find out. One at which it dies is tried once more. Then
    another worker goes on with the checks that are left.

    Raises:
        Stopped: by `stop`.
    """
    result = all_checks(job.model_copy(update={"cells": []}))
    left = _checks(job)
    lost: list[CheckResult] = []
    died_at = ""
    while left and len(lost) < LOST:
        cells = [cell for cell in job.cells if cell.points is None or cell in left]
        part = job.model_copy(update={"cells": cells})
        limit = _limit(len(left))
        run = run_in_sandbox(
            ["autograder.grading.worker"], part.model_dump_json().encode("utf-8"), job.isolation, limit, stop
        )
        _add(result, run.stdout, job)
        known = {check.grade_id for check in result.checks}
        left = [cell for cell in left if cell.grade_id not in known]
        if not left:
            break
        if run.timed_out or _STACKS in b"\n" + run.stdout:
            lost.append(_stuck(left.pop(0), run, limit))
        elif died_at == left[0].grade_id:
            because = f"The grader ended with status {run.status} and no result."
            lost.append(_undecided(left.pop(0), because, run.stderr))
        else:
            died_at = left[0].grade_id
    result.checks += lost
    for cell in left:
        because = "It was not run: at other checks of this submission the grader got stuck or died."
        result.checks.append(_undecided(cell, because, "", lost[-1].outcomes[0].code))
    return believed(job, result)


def _limit(checks: int) -> float:
    """Seconds after which a worker with so many checks is ended from outside."""
    return CELL_SECONDS + 2 * STUCK_SECONDS + SECONDS_PER_CHECK * checks


def _add(result: SubmissionResult, said: bytes, job: Job) -> None:
    """Add to a result what a worker said; its last line may be half of one."""
    for line in said.splitlines():
        try:
            part = SubmissionResult.model_validate_json(line)
        except ValidationError:
            return
        if (part.student, part.lab, part.digest) == (job.student, job.lab, job.digest):
            result.checks += part.checks
            result.logs += part.logs
            taken = result.seconds.get("checks", 0.0) + part.seconds.get("checks", 0.0)
            result.seconds["checks"] = round(taken, 3)


def believed(job: Job, result: SubmissionResult) -> SubmissionResult:
    """Keep of a worker's result what belongs to the job; a check that is missing or impossible is undecided."""
    by_id = {check.grade_id: check for check in result.checks}
    checks = []
    for cell in _checks(job):
        check = by_id.get(cell.grade_id)
        possible = check is not None and (check.points is None or 0.0 <= check.points <= check.max_points)
        if check is None or not possible or check.max_points != cell.points:
            check = _undecided(cell, "The grader returned no usable result for this check.", "")
        checks.append(check.model_copy(update={"title": cell.title}))
    return result.model_copy(update={"checks": checks, "isolation": job.isolation, "seed": job.seed})


def unknown(job: Job, because: str, stderr: str) -> SubmissionResult:
    """Return a result in which no check is decided, for an instructor to look at."""
    outcome = _undecided(Cell(grade_id="", points=0.0, source=""), because, stderr).outcomes[0]
    return all_checks(job, outcome)


def all_checks(job: Job, outcome: Outcome | None = None, points: float | None = None) -> SubmissionResult:
    """Return a result of a job in which every check has the same outcome, and the same points or none."""
    outcomes = [] if outcome is None else [outcome]
    return SubmissionResult(
        student=job.student,
        lab=job.lab,
        digest=job.digest,
        isolation=job.isolation,
        seed=job.seed,
        problems=job.problems,
        checks=[_check(cell, outcomes, points) for cell in _checks(job)],
    )


def _checks(job: Job) -> list[Cell]:
    return [cell for cell in job.cells if cell.points is not None]


def _stuck(cell: Cell, run: OuterRun, limit: float) -> CheckResult:
    stacks = (b"\n" + run.stdout).partition(_STACKS)[2].decode("utf-8", "replace")
    if not stacks:
        return _undecided(cell, f"The grader took longer than {limit:.0f} s.", run.stderr, STUCK)
    because = f"The grader got stuck in this check and was ended after {CELL_SECONDS + STUCK_SECONDS:.0f} s."
    main_thread = stacks.strip().split("\n\n")[-1].splitlines()  # its newest call comes first
    check = _undecided(cell, because, "\n".join(main_thread[: 1 + _LINES]), STUCK)
    check.flags.append(
        "The grader stopped answering while the programs of a check ran, which honest programs do not bring about; "
        "packets that a program makes up itself, past ROS, can. Read the programs before you decide about the points."
    )
    return check


def _undecided(cell: Cell, because: str, said: str, code: str = NO_RESULT) -> CheckResult:
    outcome = Outcome(
        status=Status.UNKNOWN,
        title="the grader finished this check",
        because=because,
        observed="\n".join(said.strip().splitlines()[-1 - _LINES :])[-1000:],
        hint="No points are taken. Your instructor decides.",
        code=code,
    )
    return _check(cell, [outcome], None)


def _check(cell: Cell, outcomes: list[Outcome], points: float | None) -> CheckResult:
    return CheckResult(
        grade_id=cell.grade_id, title=cell.title, max_points=cell.points or 0.0, points=points, outcomes=outcomes
    )
