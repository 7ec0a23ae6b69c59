"""Run jobs on this machine."""

from __future__ import annotations

import threading
from collections.abc import Callable, Generator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor, as_completed

from autograder.core.errors import KitError
from autograder.core.results import SubmissionResult
from autograder.grading.job import Job
from autograder.grading.supervisor import run_in_worker, unknown


class Local:
    """Runs several jobs at the same time, each in its own sandbox.

    Threads are sufficient, because everything that takes time or may fail happens in the sandboxes. Each sandbox is a
    separate process tree that ends with the thread that started it, however this process ends.

    Args:
        at_once: the number of jobs that run at the same time.
    """

    def __init__(self, at_once: int) -> None:
        """Store the argument without starting anything."""
        self._at_once = at_once

    def run(self, jobs: Sequence[Job], started: Callable[[str], None]) -> Generator[SubmissionResult, None, None]:
        """Run jobs as described in `Executor.run`."""
        stop = threading.Event()

        def run(job: Job) -> SubmissionResult:
            started(job.student)
            return run_in_worker(job, stop)

        pool = ThreadPoolExecutor(self._at_once, thread_name_prefix="submission")
        try:
            futures = {pool.submit(run, job): job for job in jobs}
            for future in as_completed(futures):
                yield _result_of(future, futures.pop(future))  # a future that is kept also keeps its result in memory
        finally:
            stop.set()
            pool.shutdown(cancel_futures=True)


def _result_of(future: Future[SubmissionResult], job: Job) -> SubmissionResult:
    try:
        return future.result()
    except KitError:
        raise
    except Exception as error:  # the other submissions must still be graded
        return unknown(job, f"The grading process failed: {type(error).__name__}.", str(error))
