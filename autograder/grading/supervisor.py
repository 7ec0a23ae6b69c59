"""Runs the grading worker on one job. What becomes of the worker costs at most the check that it was at."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from queue import SimpleQueue
from typing import Protocol

from pydantic import ValidationError

from autograder.core.results import CheckResult, Outcome, SubmissionResult
from autograder.course.lab import Cell
from autograder.grading import trusted_result
from autograder.grading.builds import with_interfaces
from autograder.grading.job import CELL_SECONDS, STUCK_SECONDS, Job
from autograder.grading.trusted_result import believed, is_open, undecided, validated, was_killed
from autograder.graph.patience import ALONE
from autograder.reasons import KINDS, Group, Kind
from autograder.sandbox.grading_sandbox import SandboxRun, run_in_sandbox

STUCK = Kind("stuck", "the grader made no progress at this check; an instructor decides", Group.GRADER)
DIED = Kind("died", "the grader died at this check, twice; an instructor decides", Group.GRADER)


class Follower(Protocol):
    """Shows what becomes known. It is told in the thread that has asked for the run, and may take its time."""

    def begun(self, problems: Sequence[Outcome]) -> None:
        """The submission has been read: this is wrong with it as a whole."""

    def at(self, worker: int, what: str) -> None:
        """A worker is at this check now; empty: it has nothing more to do."""

    def decided(self, check: CheckResult) -> None:
        """A check came to this; nothing will change that."""


Told = CheckResult | tuple[int, str]
"""A check's result, or which worker is at what."""


class ResultListener:
    """Hears one worker's results while it still runs, line by line.

    Args:
        worker: its number.
        tell: is called with what is heard, in the thread that reads; it must not wait for anybody.
    """

    def __init__(self, worker: int, tell: Callable[[Told], None]) -> None:
        """Nothing has been heard yet."""
        self._worker, self._tell = worker, tell
        self._left: list[Cell] = []
        self._line = bytearray()
        self._killed: set[str] = set()

    def begin(self, cells: Sequence[Cell]) -> None:
        """A process begins with these checks."""
        self._left, self._line = list(cells), bytearray()
        self._now()

    def hear(self, data: bytes) -> None:
        """It has written more."""
        *ends, rest = data.split(b"\n")
        for end in ends:
            self._line += end
            self._take(bytes(self._line))
            self._line.clear()
        self._line += rest

    def _take(self, line: bytes) -> None:
        try:
            check = CheckResult.model_validate_json(line)
        except ValidationError:
            self._left = []  # no result comes after what is none
            return
        cell = next((one for one in self._left if one.grade_id == check.grade_id), None)
        if cell is not None:
            self._left.remove(cell)
            if was_killed(check) and check.grade_id not in self._killed:
                self._killed.add(check.grade_id)  # it is tried once more
            elif not is_open(check):  # else it is run again, alone, when the others have ended
                self._tell(believed(cell, check))
            self._now()

    def _now(self) -> None:
        self._tell((self._worker, self._left[0].title or self._left[0].grade_id if self._left else ""))


SECONDS_PER_CHECK = 120.0
"""Seconds that each check may take on average; besides, one of them may get stuck. It takes 10 on a quiet machine."""
LOST = 2
"""Checks that a submission may lose to a worker; then the rest of them is given up, too."""
_LINES = 6
"""Lines that are kept of the stack of a worker that got stuck."""
_STACKS = b"\nTimeout ("
"""How the stacks begin that the worker writes when it is stuck; no text in a line of JSON holds the end of a line."""


def run_in_worker(job: Job, stop: threading.Event | None = None) -> SubmissionResult:
    """Run a job's checks in the sandbox. What each one comes to is kept as soon as it is known.

    Args:
        job: the submission and its checks.
        stop: when it is set, the run is ended.

    Raises:
        Stopped: by `stop`.
    """
    began = time.monotonic()
    return _result(job, _run_share(with_interfaces(job, 1, stop), job.checks, stop), began)


def run_in_workers(job: Job, workers: int, follower: Follower | None = None) -> SubmissionResult:
    """As `run_in_worker`, with the checks shared by several workers that run at once.

    Checks know nothing of each other: who waits for one submission waits less with several workers; a class, of which
    many run at once anyway, is cheaper with one each.

    Args:
        job: the submission and its checks.
        workers: how many.
        follower: is told what each check came to while others still run.
    """
    began = time.monotonic()
    if follower is not None and job.interfaces:
        follower.at(0, "building the packages")
    job = with_interfaces(job, workers)
    shares = [share for share in (job.checks[number::workers] for number in range(workers)) if share]
    given_up = threading.Event()
    told: SimpleQueue[Told | Future[list[CheckResult]]] = SimpleQueue()
    with ThreadPoolExecutor(max(1, len(shares)), thread_name_prefix="share") as pool:
        try:  # from the first share on: Ctrl-C may come before the last of them is begun
            for number, share in enumerate(shares):
                listener = ResultListener(number, told.put) if follower is not None else None
                pool.submit(_run_share, job, share, given_up, listener).add_done_callback(told.put)
            checks = _follow(told, len(shares), follower)
        except BaseException:  # nobody waits for the shares any more
            given_up.set()
            raise
    result = _result(job, checks, began)
    again = trusted_result.open_checks(job, result)
    return result if again is None else _again(again, result, follower)


def _again(job: Job, first: SubmissionResult, follower: Follower | None) -> SubmissionResult:
    """Run the open checks of a result once more, now that nothing else runs."""
    if follower is not None:
        follower.at(0, "once more, alone: " + ", ".join(cell.title or cell.grade_id for cell in job.checks))
    result = trusted_result.settled(job, first, run_in_worker(job))
    for check in result.checks:
        if follower is not None and check.run_again:
            follower.decided(check)
    return result


def _follow(
    told: SimpleQueue[Told | Future[list[CheckResult]]], shares: int, follower: Follower | None
) -> list[CheckResult]:
    """Pass on what is heard of the shares until all have ended, and return what they came to.

    This thread does it: one that reads what a worker writes must not wait until somebody scrolls on.
    """
    checks: list[CheckResult] = []
    while shares:
        heard = told.get()
        if isinstance(heard, Future):
            checks += heard.result()
            shares -= 1
        elif follower is not None and isinstance(heard, CheckResult):
            follower.decided(heard)
        elif follower is not None and isinstance(heard, tuple):
            follower.at(*heard)
    return checks


def _result(job: Job, checks: list[CheckResult], began: float) -> SubmissionResult:
    result = job.result(checks)
    result.seconds["checks"] = round(sum(check.seconds for check in checks), 3)
    result.seconds["total"] = round(time.monotonic() - began, 3)
    return validated(result, job.checks)


def _run_share(
    job: Job, share: Sequence[Cell], stop: threading.Event | None, listener: ResultListener | None = None
) -> list[CheckResult]:
    """Run some of a job's checks, one after the other.

    At a check at which the worker gets stuck, nobody could find out. One at which it dies is tried once more, and so is
    one that fails because a program was killed. Then another worker goes on with the checks that are left.
    """
    decided: list[CheckResult] = []
    left = list(share)
    lost: list[CheckResult] = []
    died_at = ""
    killed: set[str] = set()
    while left and len(lost) < LOST:
        cells = [cell for cell in job.cells if cell.points is None or cell in left]
        part = job.model_copy(update={"cells": cells})
        seconds = limit(len(left)) + ALONE * job.alone * len(left) + job.build_seconds
        if listener is not None:
            listener.begin(left)
        run = run_in_sandbox(
            ["autograder.grading.worker"],
            part.model_dump_json().encode("utf-8"),
            job.isolation,
            seconds,
            stop,
            listener.hear if listener is not None else None,
        )
        said = _said(run.stdout)
        once_more = {check.grade_id for check in said if was_killed(check)} - killed
        killed |= once_more
        known = {check.grade_id for check in decided + said}
        decided += [check for check in said if check.grade_id not in once_more]
        open_at = next((cell for cell in left if cell.grade_id not in known), None)
        left = [cell for cell in left if cell.grade_id not in known - once_more]
        if open_at is None:
            continue
        if run.timed_out or _STACKS in b"\n" + run.stdout:
            left.remove(open_at)
            lost.append(_stuck(open_at, run, seconds))
        elif died_at == open_at.grade_id:
            left.remove(open_at)
            lost.append(_died(open_at, run))
        else:
            died_at = open_at.grade_id
    because = "It was not run: at other checks of this submission the grader got stuck or died."
    return [*decided, *lost, *(undecided(cell, because, kind=KINDS[lost[-1].outcomes[0].code]) for cell in left)]


def limit(checks: int) -> float:
    """Return the seconds after which a worker with so many checks is ended from outside."""
    return CELL_SECONDS + 2 * STUCK_SECONDS + SECONDS_PER_CHECK * checks


def _said(output: bytes) -> list[CheckResult]:
    """The results that a worker gave; its last line may be half of one."""
    checks = []
    for line in output.splitlines():
        try:
            checks.append(CheckResult.model_validate_json(line))
        except ValidationError:
            break
    return checks


def unknown(job: Job, because: str, said: str = "") -> SubmissionResult:
    """Return a result in which no check is decided, for an instructor to look at."""
    return job.result([undecided(cell, because, said) for cell in job.checks])


def _died(cell: Cell, run: SandboxRun) -> CheckResult:
    because = f"The grader ended twice at this check, at last with status {run.status}, without a result."
    check = undecided(cell, because, run.stderr, DIED)
    check.flags.append(
        "The grader itself died while the programs of a check ran, and again when the check was tried once more. "
        "Packets that a program makes up itself, past ROS, can bring that about, and so can a machine without free "
        "memory. Read the programs, and run them once more with --force, before you decide about the points."
    )
    return check


def _stuck(cell: Cell, run: SandboxRun, seconds: float) -> CheckResult:
    stacks = (b"\n" + run.stdout).partition(_STACKS)[2].decode("utf-8", "replace")
    if not stacks:
        return undecided(cell, f"The grader took longer than {seconds:.0f} s.", run.stderr, STUCK)
    because = f"The grader got stuck in this check and was ended after {CELL_SECONDS + STUCK_SECONDS:.0f} s."
    main_thread = stacks.strip().split("\n\n")[-1].splitlines()  # its newest call comes first
    check = undecided(cell, because, "\n".join(main_thread[: 1 + _LINES]), STUCK)
    check.flags.append(
        "The grader stopped answering while the programs of a check ran, which honest programs do not bring about; "
        "packets that a program makes up itself, past ROS, can. Read the programs before you decide about the points."
    )
    return check
