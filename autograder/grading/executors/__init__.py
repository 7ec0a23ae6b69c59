"""Who runs the jobs of a class: a module for each executor, and a line for it here."""

from __future__ import annotations

from collections.abc import Callable

from autograder.core.errors import KitError
from autograder.grading.executors.dask import Dask
from autograder.grading.executors.executor import Executor
from autograder.grading.executors.local import Local

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
