"""Who runs the jobs of a class: a module for each executor, and a line for it here."""

from __future__ import annotations

from collections.abc import Callable, Generator, Sequence
from typing import Protocol

from autograder.core.errors import KitError
from autograder.core.results import SubmissionResult
from autograder.grading.executors.dask import Dask
from autograder.grading.executors.local import Local
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


EXECUTORS: dict[str, Callable[[str, int], Executor]] = {
    "dask": lambda address, _: Dask(address),
    "local": lambda _, at_once: Local(at_once),
}
"""By the word before `://` in a course's setting `executor`: what makes one from the address behind it, and from how
many jobs are to run at once."""


def chosen(setting: str, at_once: int) -> Executor:
    """Return the executor that a course's setting names.

    Raises:
        KitError: there is none of that name.
    """
    name, _, address = setting.partition("://")
    if name not in EXECUTORS:
        raise KitError(
            f"There is no executor {setting!r}, which course.toml or the command names.",
            f"Executors: {', '.join(EXECUTORS)}.",
        )
    return EXECUTORS[name](address, at_once)


__all__ = ["EXECUTORS", "Executor", "chosen"]
