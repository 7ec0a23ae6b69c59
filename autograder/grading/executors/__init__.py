"""Executors run the jobs of a class. Each executor has its own module and an entry in `EXECUTORS`."""

from __future__ import annotations

from collections.abc import Callable, Generator, Sequence
from typing import Protocol

from autograder.core.errors import KitError
from autograder.core.results import SubmissionResult
from autograder.grading.executors.dask import Dask
from autograder.grading.executors.local import Local
from autograder.grading.job import Job
from autograder.grading.runner import Settings


class Executor(Protocol):
    """Runs jobs on any machine. A job is JSON, needs no file of the course, and is run by `run_in_worker`."""

    def run(self, jobs: Sequence[Job], started: Callable[[str], None]) -> Generator[SubmissionResult, None, None]:
        """Run several jobs at the same time, and yield each result as soon as it is known, in any order.

        `started` is called in any thread with each student whose job starts to run. It is called again if the job has
        to start again, and may be called late if the job runs on another machine.

        If a job fails, its result is `supervisor.unknown`, and the results of other jobs are not affected. When the
        generator is closed, for example after Ctrl-C, all jobs that still run are ended.

        Raises:
            KitError: no job can be run.
        """


EXECUTORS: dict[str, Callable[[str, Settings], Executor]] = {
    "dask": lambda address, _: Dask(address),
    "local": lambda _, settings: Local(settings.at_once, settings.further),
}
"""For each name that may come before `://` in a course's setting `executor`, the function that makes the executor from
the address after it and the settings of the run."""


def chosen(setting: str, settings: Settings) -> Executor:
    """Return the executor that a course's setting names.

    Raises:
        KitError: there is no executor with this name.
    """
    name, _, address = setting.partition("://")
    if name not in EXECUTORS:
        raise KitError(
            f"There is no executor {setting!r}, which course.toml or the command names.",
            f"Executors: {', '.join(EXECUTORS)}.",
        )
    return EXECUTORS[name](address, settings)


__all__ = ["EXECUTORS", "Executor", "chosen"]
