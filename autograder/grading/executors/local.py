"""Run jobs on this machine."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Generator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor, as_completed
from dataclasses import dataclass, field

from autograder.core.cpu_use import idle
from autograder.core.errors import KitError
from autograder.core.results import SubmissionResult
from autograder.grading.job import Job
from autograder.grading.supervisor import of_parts, parts, run_in_worker, unknown
from autograder.sandbox.grading_sandbox import Stopped

_IDLE, _BUSY = 0.3, 0.15
"""If more than the first share of all CPU time is unused, one more job may run; below the second share, one fewer."""
_LOOK = 2.0
"""Seconds over which this share is measured. The job that started last then uses its part of the CPUs, too."""


class Local:
    """Runs several jobs at the same time, each in its own sandbox.

    Threads are sufficient, because everything that takes time or may fail happens in the sandboxes. Each sandbox is a
    separate process tree that ends with the thread that started it, however this process ends.

    The last jobs are run in parts, because otherwise the CPUs have little to do while the longest of them ends. An
    earlier job is run as a whole, because a part costs more than a check in the middle of a job.

    Args:
        at_once: the number of jobs, or parts of jobs, that run at the same time.
        further: the number of further jobs that may run while the CPUs have too little to do. How many jobs keep them
            busy depends on the answers, because a run mostly waits, and waits longest for programs that send nothing.
    """

    def __init__(self, at_once: int, further: int = 0) -> None:
        """Store the arguments without starting anything."""
        self._at_once, self._further = at_once, further

    def run(self, jobs: Sequence[Job], started: Callable[[str], None]) -> Generator[SubmissionResult, None, None]:
        """Run jobs as described in `Executor.run`."""
        stop = threading.Event()
        room = _Room(self._at_once, stop)

        def run(part: Job, run_of: _JobRun) -> SubmissionResult:
            with room:
                if not run_of.began:
                    run_of.began = time.monotonic()
                    started(part.student)
                return run_in_worker(part, stop)

        pool = ThreadPoolExecutor(self._at_once + self._further, thread_name_prefix="submission")
        try:
            futures: dict[Future[SubmissionResult], tuple[Job, _JobRun]] = {}
            for number, job in enumerate(jobs):
                pieces = parts(job) if number >= len(jobs) - self._at_once else [job]
                run_of = _JobRun(job, len(pieces))
                futures |= {pool.submit(run, part, run_of): (part, run_of) for part in pieces}
            for future in as_completed(futures):
                part, run_of = futures.pop(future)  # a future that is kept also keeps its result in memory
                run_of.results.append(_result_of(future, part))
                if len(run_of.results) == run_of.parts:
                    yield of_parts(run_of.job, run_of.results, run_of.began)
        finally:
            stop.set()
            pool.shutdown(cancel_futures=True)


@dataclass
class _JobRun:
    """A job of which one or more parts run."""

    job: Job
    parts: int
    began: float = 0.0
    """When the first part began, on the monotonic clock; 0 before that."""
    results: list[SubmissionResult] = field(default_factory=list)


class _Room:
    """Decides how many jobs run at the same time: at least a certain number, and more while the CPUs are idle.

    Args:
        at_once: this number.
        stop: an event after which no job may begin.
    """

    def __init__(self, at_once: int, stop: threading.Event) -> None:
        """Begin without any job."""
        self._at_once, self._stop = at_once, stop
        self._most, self._running = at_once, 0
        self._came, self._begun = 0, 0
        self._changed = threading.Condition()
        self._looked, self._idle = time.monotonic(), idle()

    def __enter__(self) -> None:
        """Wait until one more job may run, and no earlier one waits: the neighbours of a canary are known by the order.

        Raises:
            Stopped: the event was set.
        """
        with self._changed:
            turn = self._came
            self._came += 1
            while (turn != self._begun or self._running >= self._most) and not self._stop.is_set():
                self._changed.wait(_LOOK / 2)
                self._look()
            if self._stop.is_set():
                raise Stopped
            self._begun += 1
            self._running += 1
            self._changed.notify_all()

    def __exit__(self, *_: object) -> None:
        """Note that a job has ended."""
        with self._changed:
            self._running -= 1
            self._changed.notify_all()

    def _look(self) -> None:
        now = time.monotonic()
        took = now - self._looked
        if took < _LOOK:
            return
        before, self._looked, self._idle = self._idle, now, idle()
        share = (self._idle - before) / took
        if share > _IDLE and self._running == self._most:
            self._most += 1
        elif share < _BUSY:
            self._most = max(self._at_once, self._most - 1)


def _result_of(future: Future[SubmissionResult], job: Job) -> SubmissionResult:
    try:
        return future.result()
    except KitError:
        raise
    except Exception as error:  # the other submissions must still be graded
        return unknown(job, f"The grading process failed: {type(error).__name__}.", str(error))
