"""The result of grading one submission: the one object behind the notebook, terminal, JSON and JUnit views.

The JSON form is versioned by `SCHEMA_VERSION`. It is written where submissions are run, and read where nbgrader records
them.
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


class Picture(BaseModel):
    """A drawing as SVG, with what it shows in words.

    As the last line of a cell it is shown. A front end that trusts no notebook, nbgrader's feedback and a browser
    without a network show it too: it is an `<img>` that holds its own data, and in such a one nothing can run.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    svg: str
    alt: str
    """What the picture shows, in words."""

    def html(self) -> str:
        """Return the `<img>`, on white paper, so that a dark page does not swallow the lines."""
        data = base64.b64encode(self.svg.encode()).decode()
        return (
            f'<img alt="{escape(" ".join(self.alt.split()))}" src="data:image/svg+xml;base64,{data}" '
            'style="background:#ffffff; max-width:100%; height:auto">'
        )

    def _repr_html_(self) -> str:
        return self.html()

    def __repr__(self) -> str:
        return self.alt

    __str__ = __repr__


SCHEMA_VERSION = 2


def encodable(text: str) -> str:
    """Replace what JSON can spell but UTF-8 cannot: halves of surrogate pairs."""
    return text.encode("utf-8", "replace").decode("utf-8")


Text = Annotated[str, AfterValidator(lambda text: plain(encodable(text)))]
"""A text that may quote a student's program, whose notes can hold anything: it can always be written and shown."""


class Status(StrEnum):
    """What became of one expectation."""

    PASSED = "passed"
    FAILED = "failed"
    NOT_CHECKED = "not checked"
    """Something earlier in the same check failed, so this was not looked at."""
    UNKNOWN = "could not find out"
    """The grader itself failed. No points are taken; the instructor decides."""


class Isolation(StrEnum):
    """How a student's programs were kept away from everything else."""

    FULL = "full"
    """bubblewrap: own user, process, IPC and network namespaces, seccomp, limits."""
    REDUCED = "reduced"
    """Landlock, seccomp and limits; the network and the process list are shared."""
    NONE = "none"
    """No isolation at all: plain child processes with limits."""


class _Model(BaseModel):
    model_config = ConfigDict(extra="forbid")


class Outcome(_Model):
    """One expectation and what came of it, worded for a student."""

    status: Status
    title: Text
    """The expectation as a short sentence: `node /talker is on the graph`."""
    expected: Text = ""
    observed: Text = ""
    because: Text = ""
    """The first broken link of the chain, as a sentence."""
    hint: Text = ""
    """What to look at next, and where to read on."""
    code: str = ""
    """A short stable word for the reason, such as `qos-reliability`; tests and statistics use it."""
    hidden: bool = False
    """It stems from a hidden test: students see that it failed and the hint, nothing else."""
    picture: Picture | None = None
    """What explains the reason better than words."""
    part: str = ""
    """Title of the part of the check that it belongs to; empty: it holds for all parts of its launch."""


class Part(_Model):
    """One requirement of a check that gives points of its own."""

    title: str
    max_points: float
    points: float
    more_at_grading: bool = False
    """What is visible of it holds; the points are decided by tests that are hidden here."""


class NodeLog(_Model):
    """What one program of the student's printed, capped, and how it ended."""

    program: str
    text: str = ""
    truncated: bool = False
    exit_status: int | None = None
    """None: it was still running when the check stopped it. Negative: the number of the signal that ended it."""
    stopped_by: str = ""
    """The limit that ended it, such as `memory limit`; empty if none did."""


class CellResult(_Model):
    """What one cell of checks found out, and the points for it; which check of a lab that is, is not its business."""

    max_points: float
    points: float | None = None
    """None: the grader could not find out; an instructor decides."""
    seconds: float = 0.0
    starved: float = 0.0
    """Seconds for which others kept the programs, or the grader, from the CPUs when something was decided against them;
    0 if that cannot have made a difference."""
    outcomes: list[Outcome] = Field(default_factory=list)
    parts: list[Part] = Field(default_factory=list)
    """The parts that give points independently of each other; empty: all or nothing."""
    more_at_grading: bool = False
    """Hidden tests were taken out of this copy of the check: what is passed here is not yet earned."""

    flags: list[Text] = Field(default_factory=list)
    """What an instructor should look at, such as what contradicts itself, or cannot be read; it changes no points."""
    not_attempted: list[str] = Field(default_factory=list)
    """Files of answer cells that are still as students receive them; for this the check did not pass."""
    logs: list[NodeLog] = Field(default_factory=list)
    """What the programs printed that it launched."""

    @property
    def sure_points(self) -> float | None:
        """Points that grading will give as well, whatever its hidden tests find; None: nobody could find out."""
        if self.points is None or not self.more_at_grading:
            return self.points
        return sum(part.points for part in self.parts if not part.more_at_grading)

    @property
    def possible_points(self) -> float:
        """Points that grading can still give: all but those that are lost already."""
        return self.max_points if self.points is None else self.points

    @property
    def status(self) -> Status:
        """The worst outcome: could not find out, then failed, then passed."""
        statuses = {outcome.status for outcome in self.outcomes}
        if self.points is None or Status.UNKNOWN in statuses:
            return Status.UNKNOWN
        return Status.FAILED if self.not_attempted or statuses - {Status.PASSED} else Status.PASSED

    @property
    def first_failure(self) -> Outcome | None:
        """The outcome that decided, if the check did not pass."""
        return next((o for o in self.outcomes if o.status in (Status.FAILED, Status.UNKNOWN)), None)


class CheckResult(CellResult):
    """One graded check of a lab."""

    grade_id: str = Field(min_length=1)
    title: str = ""
    """The nearest heading above its cell."""
    run_again: bool = False
    """It was run a second time, alone, because others had kept its programs from the CPUs."""


class SubmissionResult(_Model):
    """Everything that is known of one graded submission."""

    schema_version: int = SCHEMA_VERSION
    kit_version: str = VERSION
    student: str
    lab: str
    digest: str
    """SHA-256 over the submission's files, the lab's source and the kit's: it changes when any of them does."""
    isolation: Isolation
    seed: int = 0
    """Seed of the values that differ from run to run."""
    problems: list[Outcome] = Field(default_factory=list)
    """What is wrong with the submission as a whole: a broken notebook, a forged cell."""
    checks: list[CheckResult] = Field(default_factory=list)
    seconds: dict[str, float] = Field(default_factory=dict)
    """Durations in seconds, by step."""

    @property
    def points(self) -> float:
        """Points earned so far; a check nobody could decide counts 0 until an instructor does."""
        return sum(check.sure_points or 0.0 for check in self.checks)

    @property
    def possible_points(self) -> float:
        """Points that grading can still give; more than `points` where hidden tests or a person decide."""
        return sum(check.possible_points for check in self.checks)

    @property
    def max_points(self) -> float:
        """Points that the automatic checks can give."""
        return sum(check.max_points for check in self.checks)

    @property
    def flags(self) -> list[str]:
        """Contradictions that a person should look at, of all checks, each once."""
        return list(dict.fromkeys(flag for check in self.checks for flag in check.flags))

    def without_pictures(self) -> SubmissionResult:
        """The same without what is most of it, for who holds a whole class in memory."""
        checks = [
            check.model_copy(
                update={"outcomes": [outcome.model_copy(update={"picture": None}) for outcome in check.outcomes]}
            )
            for check in self.checks
        ]
        return self.model_copy(update={"checks": checks})

    def save(self, path: Path) -> None:
        """Write the result as JSON, whole or not at all."""
        write_beside(path, self.model_dump_json(indent=1) + "\n")

    @classmethod
    def load(cls, path: Path) -> SubmissionResult:
        """Read a result; pydantic's ValidationError if it is not one of this schema version."""
        return cls.model_validate_json(path.read_text(encoding="utf-8"))
