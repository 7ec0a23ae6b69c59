"""A job is the input of the worker in the sandbox: one submission as text, and the trusted cells to run on it."""

from __future__ import annotations

import re
from collections.abc import Mapping

from pydantic import BaseModel, ConfigDict, Field

from autograder.core.results import CheckResult, Isolation, Outcome, SubmissionResult
from autograder.course.lab import Cell
from autograder.packages.workspace import SOURCES
from autograder.sandbox.build import BUILD_SECONDS, BuildRun

CELL_SECONDS = 240.0
"""Seconds after which a check cell is ended. This is twice as long as any cell takes on a busy machine.

There is also a limit for all cells together (`supervisor.SECONDS_PER_CHECK`).
"""
CELL_CPU_SECONDS = 30.0
"""Seconds of the grader's own CPU time after which a check cell is ended, because it had far too much to process. For
right answers it takes less than 1 s. The CPU time of the student's programs does not count."""
STUCK_SECONDS = 30.0
"""Further seconds after which the worker ends because the cell is stuck in a call that no exception can interrupt."""

MOST_PACKAGES = 3
"""The number of packages of a submission for which the time limit is extended, and that are built before the checks."""


def _mentions(cell: Cell, package: str) -> bool:
    """Whether a trusted cell names a package: as a text, or where it imports from it."""
    name = re.escape(package)
    return bool(re.search(rf"""(["']){name}\1|\b(from|import) {name}\b""", cell.source))


def _packages_of_interfaces(files: Mapping[str, str]) -> dict[str, dict[str, str]]:
    found: dict[str, dict[str, str]] = {}
    for name, text in files.items():
        folder, _, path = name.removeprefix(f"{SOURCES}/").partition("/")
        if f"{SOURCES}/{folder}/CMakeLists.txt" in files and f"{SOURCES}/{folder}/{path}" == name:
            found.setdefault(folder, {})[path] = text
    return found


class Job(BaseModel):
    """Everything that the worker may know about a submission. It has no other input."""

    model_config = ConfigDict(extra="forbid")

    student: str
    lab: str
    digest: str
    isolation: Isolation
    seed: int
    """Seed of the random values that differ from run to run."""
    files: dict[str, str]
    """The text of the files that the `%%node` and `%%file` cells hold, by file name, such as `talker.py`."""
    answers: dict[str, bool] = Field(default_factory=dict)
    """For each file that is an answer, whether its cell is still as students receive it."""
    reference: dict[str, str] = Field(default_factory=dict)
    """The text of the files of the lab's own packages of interfaces, by file name. In a check of another answer, such a
    package stands in for a wrong one of the student."""
    cells: list[Cell]
    built: dict[str, BuildRun] = Field(default_factory=dict)
    """Results of builds of the packages from before the worker started, by the digest of the package."""
    problems: list[Outcome] = Field(default_factory=list)
    alone: bool = False
    """Whether these checks are run again, alone. Then nothing else of this kit runs, and waits may take longer."""
    messages: bool = False
    """Whether the worker also returns the messages that the checks received."""
    records: bool = False
    """Whether the worker also returns what the launches of the checks did."""

    @property
    def build_seconds(self) -> float:
        """Seconds that building the packages may take in addition to the time for the checks."""
        folders = {name.split("/")[1] for name in self.files if name.startswith(f"{SOURCES}/")}
        packages = [name for name in folders if any(_mentions(cell, name) for cell in self.cells)]
        return BUILD_SECONDS * min(len(packages), MOST_PACKAGES)

    @property
    def interfaces(self) -> list[tuple[str, dict[str, str]]]:
        """The packages of interfaces that a trusted cell mentions: their names, and their files by path in the package.

        They are those of the lab's reference and those of the student, of whom only the first few count.
        """
        return [
            package
            for files in (self.reference, self.files)
            for package in [
                (name, found)
                for name, found in _packages_of_interfaces(files).items()
                if any(_mentions(cell, name) for cell in self.cells)
            ][:MOST_PACKAGES]
        ]

    def uses_interfaces(self, cell: Cell) -> bool:
        """Whether a check, or a cell that runs before all checks, mentions a package of interfaces."""
        seen = [cell, *(one for one in self.cells if one.points is None)]
        return any(_mentions(one, package) for package, _ in self.interfaces for one in seen)

    @property
    def checks(self) -> list[Cell]:
        """The cells that give points."""
        return [cell for cell in self.cells if cell.points is not None]

    def result(self, checks: list[CheckResult]) -> SubmissionResult:
        """Return the result of this job with these checks."""
        return SubmissionResult(
            student=self.student,
            lab=self.lab,
            digest=self.digest,
            isolation=self.isolation,
            seed=self.seed,
            problems=self.problems,
            checks=checks,
        )
