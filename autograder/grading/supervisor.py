"""Run the grading worker on one job. If the worker dies or gets stuck, usually only the current check is affected."""

from __future__ import annotations

import re
import threading
import time
from collections.abc import Callable, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from queue import SimpleQueue
from typing import Protocol

from pydantic import ValidationError

from autograder.core.results import CheckResult, Isolation, Outcome, SubmissionResult
from autograder.course.lab import Cell
from autograder.grading import trusted_result
from autograder.grading.builds import with_interfaces
from autograder.grading.job import CELL_SECONDS, STUCK_SECONDS, Job
from autograder.grading.trusted_result import believed, is_open, needs_another_try, undecided, validated
from autograder.graph.patience import ALONE
from autograder.reasons import KINDS, Group, Kind
from autograder.sandbox.grading_sandbox import SandboxRun, run_in_sandbox

STUCK = Kind("stuck", "the grader made no progress at this check; an instructor decides", Group.GRADER)
DIED = Kind("died", "the grader died at this check, twice; an instructor decides", Group.GRADER)


class Follower(Protocol):
    """Shows the progress of a run. It is called in the thread that has asked for the run, so it may take time."""

    def begun(self, problems: Sequence[Outcome]) -> None:
        """Show that the submission has been read, and the problems of the submission as a whole."""

    def at(self, worker: int, what: str) -> None:
        """Show which check a worker is running; an empty text means that it has nothing more to do."""

    def decided(self, check: CheckResult) -> None:
        """Show the final result of a check."""


Told = CheckResult | tuple[int, str]
"""The result of a check, or the number of a worker and the check that it is running."""


class ResultListener:
    """Reads the results of a worker line by line while it still runs.

    Args:
        worker: the worker's number.
        tell: a function that is called with each piece of news, in the thread that reads. It must not block.
    """

    def __init__(self, worker: int, tell: Callable[[Told], None]) -> None:
        """Store the arguments and begin without any results."""
        self._worker, self._tell = worker, tell
        self._left: list[Cell] = []
        self._line = bytearray()
        self._tried: set[str] = set()

    def begin(self, cells: Sequence[Cell]) -> None:
        """Note that a worker process starts with these checks."""
        self._left, self._line = list(cells), bytearray()
        self._now()

    def wait(self, what: str) -> None:
        """Note that the worker cannot start yet, and what it waits for."""
        self._tell((self._worker, what))

    def hear(self, data: bytes) -> None:
        """Take further output of the worker."""
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
            self._left = []  # after a line that is no result there are no more results
            return
        cell = next((one for one in self._left if one.grade_id == check.grade_id), None)
        if cell is not None:
            self._left.remove(cell)
            if needs_another_try(check) and check.grade_id not in self._tried:
                self._tried.add(check.grade_id)
            elif not is_open(check):  # otherwise it is run again, alone, when the others have ended
                self._tell(believed(cell, check))
            self._now()

    def _now(self) -> None:
        self._tell((self._worker, self._left[0].title or self._left[0].grade_id if self._left else ""))


_STARTS = re.compile(r"\b(launch|launch_file|build)\(")
"""The calls with which a check starts or builds something."""

SECONDS_PER_CHECK = 120.0
"""Seconds that each check may take on average, in addition to the time for one check that gets stuck. On a quiet
machine a check takes 10 s."""
LOST = 2
"""The number of checks at which the worker may die or get stuck. After that, the other checks are not run."""
_LINES = 6
"""The number of lines that are kept from the stack of a worker that got stuck."""
_STACKS = b"\nTimeout ("
"""The beginning of the stacks that a stuck worker writes. It begins with a newline, so no line of JSON contains it."""


def run_in_worker(job: Job, stop: threading.Event | None = None) -> SubmissionResult:
    """Run a job's checks in the sandbox. The result of each check is kept even if the worker then dies.

    Args:
        job: the submission and its checks.
        stop: an event that ends the run when it is set.

    Raises:
        Stopped: `stop` was set.
    """
    began = time.monotonic()
    return _result(job, _run_share(with_interfaces(job, 1, stop), job.checks, stop), began)


def run_in_workers(job: Job, workers: int, follower: Follower | None = None) -> SubmissionResult:
    """Run a job's checks like `run_in_worker`, but several at the same time, each in a worker and a network of its own.

    This is possible because checks do not depend on each other. A person waits less for a single submission, because a
    check mostly waits for messages. In a class, many submissions run at the same time anyway, so one worker for each is
    cheaper, except for the last ones (`parts`). Checks that use no package of interfaces do not wait until these are
    built.

    Args:
        job: the submission and its checks.
        workers: the number of workers that run at the same time.
        follower: is told the result of each check while others still run.
    """
    began = time.monotonic()
    given_up = threading.Event()
    told: SimpleQueue[Told | Future[list[CheckResult]]] = SimpleQueue()
    shares = _shares(job) if workers > 1 else [job.checks]
    with ThreadPoolExecutor(workers, thread_name_prefix="share") as pool, ThreadPoolExecutor(1, "build") as builder:
        try:  # the first share is already inside, because Ctrl-C may come before the last share has started
            built = builder.submit(with_interfaces, job, workers, given_up) if job.interfaces else None
            for number, share in enumerate(shares):
                waits_for = built if any(map(job.uses_interfaces, share)) else None
                listener = ResultListener(number, told.put) if follower is not None else None
                pool.submit(_run_when_built, job, waits_for, share, given_up, listener).add_done_callback(told.put)
            checks = _follow(told, len(shares), follower)
        except BaseException:  # the results of the shares are no longer needed
            given_up.set()
            raise
    result = _result(job, checks, began)
    if not trusted_result.has_open_checks(result):
        return result
    return _again(trusted_result.to_run_again(job, result, alone=True), result, follower)


def parts(job: Job) -> list[Job]:
    """Return jobs that together have the checks of a job, and that may run at the same time (`run_in_workers`).

    Without full isolation, a build is not kept for the next part that needs it, so such a job remains whole.
    """
    shares = _shares(job)
    if len(shares) < 2 or job.alone or (job.interfaces and job.isolation is not Isolation.FULL):
        return [job]
    return [
        job.model_copy(update={"cells": [cell for cell in job.cells if cell.points is None or cell in share]})
        for share in shares
    ]


def of_parts(job: Job, results: Sequence[SubmissionResult], began: float) -> SubmissionResult:
    """Return the result of a job from the results of its parts.

    Args:
        job: the whole job.
        results: the results of all its parts.
        began: when the first part began, on the monotonic clock.
    """
    return _result(job, [check for result in results for check in result.checks], began)


def _shares(job: Job) -> list[list[Cell]]:
    """Return the checks as shares that begin in this order: one for each check that starts programs, the longest first.

    How long a check takes is not known, but more happens in a long cell than in a short one. Checks that use packages
    of interfaces come last, because these are built meanwhile. All checks that start nothing are one share, because
    beginning a worker takes longer than they do.
    """
    starts = [cell for cell in job.checks if _STARTS.search(cell.source)]
    starts.sort(key=lambda cell: (job.uses_interfaces(cell), -len(cell.source)))
    others = [cell for cell in job.checks if cell not in starts]
    return [share for share in (others, *([cell] for cell in starts)) if share]


def _run_when_built(
    job: Job,
    built: Future[Job] | None,
    share: Sequence[Cell],
    stop: threading.Event | None,
    listener: ResultListener | None,
) -> list[CheckResult]:
    """Run some of a job's checks, after the packages that they use have been built."""
    if built is not None:
        if listener is not None:
            listener.wait("building the packages")
        job = built.result()
    return _run_share(job, share, stop, listener)


def _again(job: Job, first: SubmissionResult, follower: Follower | None) -> SubmissionResult:
    """Run the open checks of a result again, now that nothing else runs."""
    if follower is not None:
        follower.at(0, "again, alone: " + ", ".join(cell.title or cell.grade_id for cell in job.checks))
    result = trusted_result.settled(job, first, run_in_worker(job))
    for check in result.checks:
        if follower is not None and check.run_again:
            follower.decided(check)
    return result


def _follow(
    told: SimpleQueue[Told | Future[list[CheckResult]]], shares: int, follower: Follower | None
) -> list[CheckResult]:
    """Pass the news about the shares on to the follower until all shares have ended, and return their results.

    The follower is called in this thread, because a thread that reads a worker's output must not wait for a person who
    scrolls on.
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

    A check at which the worker gets stuck stays undecided. A check at which the worker dies is tried again, and so is a
    check that fails for something that the system can cause, too (`needs_another_try`). A new worker then continues
    with the remaining checks.
    """
    decided: list[CheckResult] = []
    left = list(share)
    lost: list[CheckResult] = []
    died_at = ""
    tried: set[str] = set()
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
        once_more = {check.grade_id for check in said if needs_another_try(check)} - tried
        tried |= once_more
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
    """Return the seconds after which a worker with this number of checks is ended from outside."""
    return CELL_SECONDS + 2 * STUCK_SECONDS + SECONDS_PER_CHECK * checks


def _said(output: bytes) -> list[CheckResult]:
    """Return the results in a worker's output, whose last line may be incomplete."""
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
        "The grader itself died while the programs of a check ran, and again when the check was tried a second time. "
        "A program that sends its own packets past ROS can cause this, and so can a machine without free memory. "
        "Read the programs, and run them again with --force, before you decide about the points."
    )
    return check


def _stuck(cell: Cell, run: SandboxRun, seconds: float) -> CheckResult:
    stacks = (b"\n" + run.stdout).partition(_STACKS)[2].decode("utf-8", "replace")
    if not stacks:
        return undecided(cell, f"The grader took longer than {seconds:.0f} s.", run.stderr, STUCK)
    because = f"The grader got stuck in this check and was ended after {CELL_SECONDS + STUCK_SECONDS:.0f} s."
    main_thread = stacks.strip().split("\n\n")[-1].splitlines()  # the newest call comes first
    check = undecided(cell, because, "\n".join(main_thread[: 1 + _LINES]), STUCK)
    check.flags.append(
        "The grader stopped answering while the programs of a check ran. Honest programs do not cause this, but a "
        "program that sends its own packets past ROS can. Read the programs before you decide about the points."
    )
    return check
