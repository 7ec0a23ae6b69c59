"""What the worker in the sandbox is given: one submission as text, and the trusted cells to run on it."""

from __future__ import annotations

from pydantic import BaseModel, ConfigDict, Field

from autograder.core.results import CheckResult, Isolation, Outcome, SubmissionResult
from autograder.course.lab import Cell
from autograder.packages.workspace import SOURCES
from autograder.sandbox.build import BUILD_SECONDS, BuildRun

CELL_SECONDS = 240.0
"""Seconds after which a check cell is ended: twice as long as any takes with all its patience on a busy machine.

All of them together have a limit too (`supervisor.SECONDS_PER_CHECK`).
"""
CELL_CPU_SECONDS = 30.0
"""Seconds of the grader's own CPU after which a check cell is ended: there was far too much to look at. Right answers
take less than 1 s; the programs' own CPU is not counted here."""
STUCK_SECONDS = 30.0
"""Seconds more after which a cell that did not end is stuck in a call that no exception reaches: the worker ends."""

MOST_PACKAGES = 3
"""As many packages of a submission are waited for."""


class Job(BaseModel):
    """Everything that the worker may know of a submission; it has no other input."""

    model_config = ConfigDict(extra="forbid")

    student: str
    lab: str
    digest: str
    isolation: Isolation
    seed: int
    """Seed of the values that differ from run to run."""
    files: dict[str, str]
    """File name to text, such as `talker.py`: what the `%%node` and `%%file` cells hold."""
    answers: dict[str, bool] = Field(default_factory=dict)
    """Of the files that are answers: whether the cell is still as students receive it."""
    cells: list[Cell]
    built: dict[str, BuildRun] = Field(default_factory=dict)
    """What builds of its packages came to before the worker began, by the digest of what was built."""
    problems: list[Outcome] = Field(default_factory=list)
    alone: bool = False
    """These checks are run again, with nothing else of this kit beside them: their waits have more time."""
    messages: bool = False
    """The messages are wanted, too, that the checks received."""

    @property
    def build_seconds(self) -> float:
        """Seconds that its packages may take to be built, besides what the checks may take."""
        packages = {name.split("/")[1] for name in self.files if name.startswith(f"{SOURCES}/")}
        return BUILD_SECONDS * min(len(packages), MOST_PACKAGES)

    @property
    def interfaces(self) -> dict[str, dict[str, str]]:
        """The packages of interfaces that a cell names: of each its files, by their path in the package."""
        found: dict[str, dict[str, str]] = {}
        for name, text in self.files.items():
            folder, _, path = name.removeprefix(f"{SOURCES}/").partition("/")
            if f"{SOURCES}/{folder}/CMakeLists.txt" in self.files and f"{SOURCES}/{folder}/{path}" == name:
                found.setdefault(folder, {})[path] = text
        return {package: files for package, files in found.items() if any(package in c.source for c in self.cells)}

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
