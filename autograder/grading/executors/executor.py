"""What an executor has to do."""

from __future__ import annotations

from collections.abc import Callable, Generator, Sequence
from typing import Protocol

from autograder.core.results import SubmissionResult
from autograder.grading.job import Job


class Executor(Protocol):
    """Runs jobs wherever it likes: a job is JSON, needs no file of the course, and goes to `run_in_worker`."""

    def run(self, jobs: Sequence[Job], started: Callable[[str], None]) -> Generator[SubmissionResult, None, None]:
        """Run jobs, several at once, and yield each result as soon as it is there, in whatever order.

        `started` is called with each student whose job begins to run, in any thread; more than once if it
        has to begin again, and from another machine perhaps late.

        A job that goes wrong costs no other job its result: it yields `supervisor.unknown`. When the generator
        is closed, as after Ctrl-C, everything is ended that still runs.

        Raises:
            KitError: no job can be run at all.
        """
