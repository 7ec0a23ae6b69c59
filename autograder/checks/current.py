"""The check that runs in this process: where its programs run, the values that vary, and its findings.

The grading worker configures this once. In a student's notebook, the programs are beside the notebook, and they run
without isolation because they are the student's own.
"""

from __future__ import annotations

import atexit
import random
import time
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from autograder.core import front_end
from autograder.core.front_end import FrontEnd
from autograder.core.results import Isolation, NodeLog, Outcome, Ranked
from autograder.graph.observer import Observer
from autograder.graph.patience import Patience
from autograder.graph.recording import Bag
from autograder.own_run.record import Record
from autograder.packages.workspace import INSTALLED, REFERENCE, SOURCES, Workspace
from autograder.sandbox.build import BuildRun
from autograder.sandbox.node_sandbox import NodeSandbox


@dataclass(frozen=True)
class Asked:
    """Something that the check sent to the programs."""

    when: float
    """Seconds on the monotonic clock, just before it was sent."""
    what: str
    """The full name of a topic or service, or "parameter"."""
    parts: frozenset[str]
    """Titles of the parts that this launch had finished with before."""


class Findings:
    """The outcomes and logs since the last score.

    A check cell may launch several times, and its score covers all of these launches. Each cell begins with an empty
    collection.
    """

    def __init__(self) -> None:
        """Begin without findings."""
        self.alone = False
        """Whether these checks are run again, with nothing else of this kit beside them."""
        self.reset()

    def reset(self) -> None:
        """Forget the findings so far, because a new cell begins."""
        self.outcomes: list[Outcome] = []
        self.part = ""
        """Title of the part of the check that is being looked at."""
        self.lost_parts: set[str] = set()
        """Parts of launches that failed as a whole, or outside of any part."""
        self.block_began = 0
        """Number of the first outcome of the current launch or table."""
        self.asked: list[Asked] = []
        """What the current launch has been sent."""
        self.finished: set[str] = set()
        """Titles of the parts that the current launch has finished with."""
        self.used: set[str] = set()
        """Names of the student's files that the check uses."""
        self.flags: list[str] = []
        """Contradictions between what the graph showed and what was seen inside the programs."""
        self.logs: list[NodeLog] = []
        self.varied: list[str] = []
        """The random values that the check drew."""
        self.references: dict[str, str] = {}
        """Packages for which, in this check, the lab's own stand in; each with the reason."""
        self.ranked: Ranked | None = None
        """What counts in the class's table of the best."""
        self.patience = Patience(self.alone)
        """How much longer the waits of this check may still take on a busy machine."""
        self.starved = 0.0
        """Seconds that others withheld from the programs when something was decided against them."""
        self._began = time.monotonic()

    def begin_block(self) -> None:
        """Note that a launch or a table begins."""
        self.block_began = len(self.outcomes)
        self.asked, self.finished = [], set()

    @property
    def seconds(self) -> float:
        """Seconds since the cell began, or since its last score."""
        return time.monotonic() - self._began


class Launched(Protocol):
    """A launch whose programs are running."""

    @property
    def observer(self) -> Observer:
        """The observer of its graph."""

    def news(self) -> list[str]:
        """Say in one sentence each what has happened to its programs; the end of a program is said once."""

    def stop(self) -> None:
        """End it."""


class CurrentCheck:
    """The state of the running check: its programs' folder and sandbox, its launch, and its findings."""

    def __init__(self) -> None:
        """Begin with the configuration of a student's notebook."""
        self.findings = Findings()
        """What has been found out since the last score."""
        self.bag = Bag()
        """The messages that it receives, where somebody wants to look at them."""
        self.records: list[Record] | None = None
        """What its launches did, where somebody wants to ask about it."""
        self._folder: Path | None = None
        self._answers: Mapping[str, bool] = {}
        self._built: Mapping[str, BuildRun] = {}
        self._reference: Mapping[str, str] = {}
        self.isolation = Isolation.NONE
        self.random = random.Random()
        self._sandbox: NodeSandbox | None = None
        self._workspace: Workspace | None = None
        self.block: Launched | None = None
        """The launch whose block runs: one at a time."""
        self.robot: Launched | None = None
        """The launch that goes on from cell to cell: one at a time."""

    def configure(
        self,
        folder: Path,
        isolation: Isolation,
        seed: int,
        answers: Mapping[str, bool] | None = None,
        built: Mapping[str, BuildRun] | None = None,
        reference: Mapping[str, str] | None = None,
    ) -> None:
        """Set where the programs are and how they are isolated; the grading worker does this once.

        Args:
            folder: holds the programs and files of the submission.
            isolation: for the programs.
            seed: of all values that vary from run to run.
            answers: the files that are answers, and of each whether its cell is still as students receive it.
            built: what builds of packages came to before, by the digest of what was built.
            reference: the files of the lab's own packages, which may stand in for the student's.
        """
        self.close()
        self._folder, self.isolation, self.random = folder, isolation, random.Random(seed)
        self._answers = answers or {}
        self._built = built or {}
        self._reference = reference or {}

    def vary_for(self, seed: str) -> None:
        """Draw the varying values for one check, so that they do not depend on which checks ran before."""
        self.random = random.Random(seed)

    @property
    def front_end(self) -> FrontEnd | None:
        """The student's notebook; None where a submission is graded."""
        return front_end.active if self._folder is None else None

    @property
    def folder(self) -> Path:
        """The folder of the programs and files."""
        if self._folder is not None:
            return self._folder
        return front_end.active.programs if front_end.active is not None else Path("nodes")

    def use(self, file_name: str) -> Path:
        """Return where a file of the student's is, and note that the check uses it."""
        self.findings.used.add(file_name)
        return self.folder / file_name

    def has(self, file_name: str) -> bool:
        """Whether there is such a file; in a notebook, whether a cell wrote it since the kernel began."""
        here = self.front_end
        return here.has(file_name) if here is not None else (self.folder / file_name).is_file()

    def blank_answers(self) -> dict[str, bool]:
        """For each answer that the check uses, whether it is still as students receive it."""
        used = self.findings.used
        if self.front_end is not None:
            return self.front_end.blank(used)
        return {name: blank for name, blank in self._answers.items() if name in used}

    @property
    def sandbox(self) -> NodeSandbox:
        """The sandbox, made at the first use."""
        if self._sandbox is None:
            self._sandbox = NodeSandbox(self.folder.resolve(), self.isolation)
        return self._sandbox

    @property
    def running(self) -> Launched | None:
        """The running launch: that of the current block, otherwise the one that goes on from cell to cell."""
        return self.block or self.robot

    @property
    def workspace(self) -> Workspace:
        """The packages that the student writes, and what has been built of them."""
        if self._workspace is None:
            self._workspace = Workspace(self.folder.resolve(), self.isolation, self._built, self._reference)
        return self._workspace

    def prefix(self, package: str) -> str:
        """Return where programs find a package, below the folder of the programs."""
        return f"{REFERENCE if package in self.findings.references else INSTALLED}/{package}"

    def use_package(self, name: str) -> None:
        """Note that the check uses the files of a package."""
        folder = self.folder / SOURCES / name
        paths = sorted(path for path in folder.rglob("*") if path.is_file())
        self.findings.used |= {str(path.relative_to(self.folder)) for path in paths}

    def close(self) -> None:
        """End every program and the sandbox."""
        self._workspace = None
        if self.robot is not None:
            self.robot.stop()
        if self._sandbox is not None:
            self._sandbox.close()
            self._sandbox = None


check = CurrentCheck()
"""One process runs one check cell at a time."""
atexit.register(check.close)
