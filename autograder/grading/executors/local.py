"""Runs jobs on this machine."""

from __future__ import annotations

import threading
from collections.abc import Callable, Generator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor, as_completed

from autograder.core.errors import KitError
from autograder.core.results import SubmissionResult
from autograder.grading.job import Job
from autograder.grading.supervisor import run_in_worker, unknown


class Local:
    """Several jobs at once, each alone in its sandbox.

    Threads will do: what takes time and may go wrong happens in the sandboxes, each a process tree of its own that
    ends with the thread that started it, however this process ends.

    Args:
        at_once: how many.
    """

    def __init__(self, at_once: int) -> None:
        """Nothing runs yet."""
        self._at_once = at_once

    def run(self, jobs: Sequence[Job], started: Callable[[str], None]) -> Generator[SubmissionResult, None, None]:
        """Run jobs, as `Executor.run` says."""
        stop = threading.Event()

        def run(job: Job) -> SubmissionResult:
            started(job.student)
            return run_in_worker(job, stop)

        pool = ThreadPoolExecutor(self._at_once, thread_name_prefix="submission")
        try:
            futures = {pool.submit(run, job): job for job in jobs}
            for future in as_completed(futures):
                yield _result_of(future, futures.pop(future))  # a kept future keeps its result in memory
        finally:
            stop.set()
            pool.shutdown(cancel_futures=True)


def _result_of(future: Future[SubmissionResult], job: Job) -> SubmissionResult:
    try:
        return future.result()
    except KitError:
        raise
    except Exception as error:  # whatever became of that run, the class goes on
        return unknown(job, f"The grading process failed: {type(error).__name__}.", str(error))
