"""The result of grading one submission. The notebook, the terminal, JSON and JUnit all show this object.

`SCHEMA_VERSION` is the version of its JSON form. The process that runs a submission writes the JSON, and the process
that records it in nbgrader's gradebook reads it.
"""

from __future__ import annotations

import base64
from enum import StrEnum
from html import escape
from pathlib import Path
from typing import Annotated

from pydantic import AfterValidator, BaseModel, ConfigDict, Field

from autograder.core.files import write_beside
from autograder.core.output import plain
from autograder.core.version import VERSION

_CARD = "border:1px solid #8c8c8c; border-radius:6px; box-sizing:border-box; max-width:100%; height:auto"
"""The style of a picture. It paints its own background; the border shows where it ends on a page of the same colour."""


class Picture(BaseModel):
    """A drawing as SVG, with a description in words.

    A notebook shows it if it is the last value of a cell. It is an `<img>` element that contains its own data and in
    which no script can run. It is therefore also shown in notebooks that Jupyter does not trust, in nbgrader's feedback
    and in a browser without a network.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    svg: str
    alt: str
    """A description of the picture in words."""

    def html(self) -> str:
        """Return the `<img>` element as a card that is readable on light and dark pages."""
        data = base64.b64encode(self.svg.encode()).decode()
        return (
            f'<img alt="{escape(" ".join(self.alt.split()))}" src="data:image/svg+xml;base64,{data}" style="{_CARD}">'
        )

    def _repr_html_(self) -> str:
        return self.html()

    def __repr__(self) -> str:
        return self.alt

    __str__ = __repr__


SCHEMA_VERSION = 2


def encodable(text: str) -> str:
    """Replace halves of surrogate pairs, which JSON can hold but UTF-8 cannot encode."""
    return text.encode("utf-8", "replace").decode("utf-8")


Text = Annotated[str, AfterValidator(lambda text: plain(encodable(text)))]
"""A text that may quote a student's program. Whatever the program wrote, the text can be saved and shown."""


class Status(StrEnum):
    """The result of one expectation."""

    PASSED = "passed"
    FAILED = "failed"
    NOT_CHECKED = "not checked"
    """Something earlier in the same check failed, so this expectation was not checked."""
    UNKNOWN = "could not find out"
    """The grader itself failed. No points are taken off; the instructor decides."""
    NOTE = "note"
    """Something about a submission that is good to know and makes no difference to its points."""


class Isolation(StrEnum):
    """How a student's programs were isolated from everything else."""

    FULL = "full"
    """bubblewrap with separate user, process, IPC and network namespaces, and with seccomp and limits."""
    REDUCED = "reduced"
    """Landlock, seccomp and limits. The network and the process list are shared with the machine."""
    NONE = "none"
    """No isolation: the programs are ordinary child processes with limits."""


class _Model(BaseModel):
    model_config = ConfigDict(extra="forbid")


class Outcome(_Model):
    """One expectation and its result, in words for a student."""

    status: Status
    title: Text
    """The expectation as a short sentence: `node /talker is on the graph`."""
    expected: Text = ""
    observed: Text = ""
    because: Text = ""
    """The first thing that went wrong, as a sentence."""
    hint: Text = ""
    """What to look at next, and where to read more."""
    code: str = ""
    """A short stable word for the reason, such as `qos-reliability`; tests and statistics use it."""
    hidden: bool = False
    """Whether it comes from a hidden test. Students then see only that it failed, and the hint."""
    picture: Picture | None = None
    """A picture that explains the reason better than words."""
    part: str = ""
    """The title of the part of the check that it belongs to; empty if it holds for all parts of its launch."""


class Part(_Model):
    """A part of a check that has its own points."""

    title: str
    max_points: float
    points: float
    more_at_grading: bool = False
    """Whether the visible tests of this part passed, and hidden tests at grading decide about the points."""


class NodeLog(_Model):
    """The output of one of the student's programs, up to a limit, and how the program ended."""

    program: str
    text: str = ""
    truncated: bool = False
    exit_status: int | None = None
    """None if the program was still running when the check stopped it; negative if a signal ended it (-SIGNAL)."""
    stopped_by: str = ""
    """The limit that ended the program, such as `memory limit`; empty if no limit did."""
    hidden: bool = False
    """Whether a hidden test has started the program. Students do not see its output then: it may print what it got."""


class Ranked(_Model):
    """What the class's table of the best is ordered by."""

    value: float
    """The least is the best."""
    unit: Text
    figures: dict[Text, float] = Field(default_factory=dict)
    """What else stands in the table, by its name."""


class CellResult(_Model):
    """The result of one check cell and its points. It does not know which check of which lab this is."""

    max_points: float
    points: float | None = None
    """None if the grader could not find out; an instructor then decides."""
    seconds: float = 0.0
    starved: float = 0.0
    """Seconds for which other processes kept the programs, or the grader, from the CPUs before an expectation failed;
    0 if this cannot have made a difference."""
    outcomes: list[Outcome] = Field(default_factory=list)
    parts: list[Part] = Field(default_factory=list)
    """The parts that give points independently of each other; empty if the check gives all of its points or none."""
    more_at_grading: bool = False
    """Whether hidden tests were removed from this copy of the check, so that a pass here has not yet earned points."""

    flags: list[Text] = Field(default_factory=list)
    """What an instructor should look at, such as a contradiction or unreadable data. Flags change no points."""
    not_attempted: list[str] = Field(default_factory=list)
    """Files of answer cells that are still as students receive them. If there are any, the check has not passed."""
    logs: list[NodeLog] = Field(default_factory=list)
    """The output of the programs that the check launched."""
    varied: list[Text] = Field(default_factory=list)
    """The random values that the check drew, in their order."""
    ranked: Ranked | None = None
    """What counts in the class's table of the best, if the check has such a table."""

    @property
    def sure_points(self) -> float | None:
        """Points that grading will give as well, whatever its hidden tests find; None if the grader could not tell."""
        if self.points is None or not self.more_at_grading:
            return self.points
        return sum(part.points for part in self.parts if not part.more_at_grading)

    @property
    def possible_points(self) -> float:
        """Points that grading can still give: the maximum without what is already lost."""
        return self.max_points if self.points is None else self.points

    @property
    def status(self) -> Status:
        """The status of the worst outcome. "Could not find out" is worse than "failed", and "failed" than "passed"."""
        statuses = {outcome.status for outcome in self.outcomes}
        if self.points is None or Status.UNKNOWN in statuses:
            return Status.UNKNOWN
        return Status.FAILED if self.not_attempted or statuses - {Status.PASSED} else Status.PASSED

    @property
    def first_failure(self) -> Outcome | None:
        """The first outcome that failed or is unknown; None if there is none."""
        return next((o for o in self.outcomes if o.status in (Status.FAILED, Status.UNKNOWN)), None)


class CheckResult(CellResult):
    """One graded check of a lab."""

    grade_id: str = Field(min_length=1)
    title: str = ""
    """The nearest heading above its cell."""
    run_again: bool = False
    """Whether the check was run a second time, alone, because other processes had kept its programs from the CPUs."""


class SubmissionResult(_Model):
    """Everything that is known about one graded submission."""

    schema_version: int = SCHEMA_VERSION
    kit_version: str = VERSION
    student: str
    lab: str
    digest: str
    """SHA-256 over the submission's files, the lab's source and the kit's source. It changes when any of them does."""
    isolation: Isolation
    seed: int = 0
    """Seed of the random values that differ from run to run."""
    problems: list[Outcome] = Field(default_factory=list)
    """Problems of the whole submission, such as a broken notebook or a forged cell, and notes about it."""
    checks: list[CheckResult] = Field(default_factory=list)
    seconds: dict[str, float] = Field(default_factory=dict)
    """Durations in seconds, by step."""

    @property
    def points(self) -> float:
        """Points earned so far. A check that could not be decided counts 0 until an instructor decides."""
        return sum(check.sure_points or 0.0 for check in self.checks)

    @property
    def possible_points(self) -> float:
        """Points that grading can still give; more than `points` if hidden tests or a person still have to decide."""
        return sum(check.possible_points for check in self.checks)

    @property
    def real_problems(self) -> list[Outcome]:
        """The problems without the notes."""
        return [problem for problem in self.problems if problem.status is not Status.NOTE]

    @property
    def max_points(self) -> float:
        """Points that the automatic checks can give."""
        return sum(check.max_points for check in self.checks)

    @property
    def run_again(self) -> bool:
        """Whether a check was run again because other processes had kept its programs from the CPUs."""
        return any(check.run_again for check in self.checks)

    @property
    def flags(self) -> list[str]:
        """What an instructor should look at, from all checks; each flag is listed once."""
        return list(dict.fromkeys(flag for check in self.checks for flag in check.flags))

    def brief(self) -> SubmissionResult:
        """Return a copy that says which points were lost and why, for code that holds the results of a whole class.

        It has no passed expectations, pictures and logs, which take most of the memory. The stored result has them.
        """
        checks = []
        for check in self.checks:
            lost = [outcome for outcome in check.outcomes if outcome.status is not Status.PASSED]
            outcomes = [outcome.model_copy(update={"picture": None}) for outcome in lost]
            checks.append(check.model_copy(update={"outcomes": outcomes, "logs": []}))
        return self.model_copy(update={"checks": checks})

    def save(self, path: Path) -> None:
        """Write the result as JSON, completely or not at all."""
        write_beside(path, self.model_dump_json(indent=1) + "\n")

    @classmethod
    def load(cls, path: Path) -> SubmissionResult:
        """Read a result from JSON.

        Raises:
            ValidationError: the file does not have the form of this schema version.
            OSError: the file cannot be read.
        """
        return cls.model_validate_json(path.read_text(encoding="utf-8"))
