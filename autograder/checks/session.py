"""What has been found out since the last score: the outcomes and logs that one check cell collects.

A check cell may launch several times; its score speaks for all of them. One process runs one cell at a time, so
there is one current collection, and it is started afresh for each cell.
"""

from __future__ import annotations

import atexit
import itertools
import os
import random
import socket
import time
from collections.abc import Mapping, Sequence
from pathlib import Path

from autograder import kernel
from autograder.graph.observer import PATIENCE
from autograder.results import CheckResult, Isolation, NodeLog, Outcome
from autograder.sandbox.nodes import NodeSandbox

_DDS_PORT = 7400
_DDS_PORTS_PER_DOMAIN = 250


class Session:
    """The current cell's findings and the sandbox that its programs run in."""

    def __init__(self) -> None:
        """Start as a student's notebook does: programs beside the notebook, no isolation from oneself."""
        self._folder: Path | None = None
        self._answers: Mapping[str, bool] = {}
        self.isolation = Isolation.NONE
        self.random = random.Random()
        self._sandbox: NodeSandbox | None = None
        self._domains = itertools.cycle(random.sample(range(1, 100), 99))
        self.reset()

    def configure(
        self, folder: Path, isolation: Isolation, seed: int, answers: Mapping[str, bool] | None = None
    ) -> None:
        """Say where the programs are and how they are kept apart; the grading worker does so once.

        Args:
            folder: holds the programs and files of the submission.
            isolation: for the programs.
            seed: of all values that vary from run to run.
            answers: the files that are answers, and of each whether its cell is still as students receive it.
        """
        self.close()
        self._folder, self.isolation, self.random = folder, isolation, random.Random(seed)
        self._answers = answers or {}

    @property
    def kernel(self) -> kernel.Kernel | None:
        """The kernel of a student's notebook; None where a submission is graded."""
        return kernel.active if self._folder is None else None

    @property
    def folder(self) -> Path:
        """Where the programs and files are."""
        if self._folder is not None:
            return self._folder
        return kernel.active.folder.path if kernel.active is not None else Path("nodes")

    def use(self, file_name: str) -> Path:
        """Return where a file of the student's is, and note that the check uses it."""
        self.used.add(file_name)
        return self.folder / file_name

    def has(self, file_name: str) -> bool:
        """Whether there is such a file; in a notebook, whether a cell wrote it since the kernel began."""
        return self.kernel.has(file_name) if self.kernel is not None else (self.folder / file_name).is_file()

    def blank_answers(self) -> dict[str, bool]:
        """Of the answers that the check uses, whether each is still as students receive it."""
        if self.kernel is not None:
            return self.kernel.blank(self.used)
        return {name: blank for name, blank in self._answers.items() if name in self.used}

    def reset(self) -> None:
        """Forget the findings so far: a new cell begins."""
        self.outcomes: list[Outcome] = []
        self.part = ""
        """Title of the part of the check that is being looked at."""
        self.lost_parts: set[str] = set()
        """Parts of launches that failed as a whole, or outside of any part."""
        self.block_began = 0
        """Number of the first outcome of the current launch or table."""
        self.used: set[str] = set()
        """Names of the student's files that the check uses."""
        self.flags: list[str] = []
        """Contradictions between what the graph showed and what was seen inside the programs."""
        self.logs: list[NodeLog] = []
        self.scored_logs: list[NodeLog] = []
        """Logs of what has been scored since the cell began."""
        self.patience = PATIENCE
        """Seconds that the waits of this check may still take longer on a busy machine."""
        self.started = time.monotonic()

    @property
    def sandbox(self) -> NodeSandbox:
        """The sandbox, made at the first use."""
        if self._sandbox is None:
            self._sandbox = NodeSandbox(self.folder.resolve(), self.isolation)
        return self._sandbox

    def close(self) -> None:
        """End every program and the sandbox."""
        if self._sandbox is not None:
            self._sandbox.close()
            self._sandbox = None

    def next_domain(self) -> int:
        """A domain id that no launch used lately and nobody on this machine seems to use."""
        for domain in itertools.islice(self._domains, 99):
            with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
                try:
                    probe.bind(("0.0.0.0", _DDS_PORT + _DDS_PORTS_PER_DOMAIN * domain + 10))
                except OSError:
                    continue
                return domain
        return next(self._domains)

    def take(self) -> tuple[list[Outcome], set[str], float]:
        """Close the collection: its outcomes, the parts lost as a whole, and the seconds that it took."""
        taken = self.outcomes, self.lost_parts, time.monotonic() - self.started
        logs = self.scored_logs + self.logs
        self.reset()
        self.scored_logs = logs
        return taken


class Score:
    """A check's result as the last expression of its cell: a front end shows the report, `repr` is the points.

    Args:
        result: of the check.
        logs: what its programs printed.
        remarks: what the student should know about the cells that the programs came from.
        origin: those cells, in words.
    """

    def __init__(
        self, result: CheckResult, logs: Sequence[NodeLog] = (), remarks: Sequence[str] = (), origin: str = ""
    ) -> None:
        """Wrap a result for display."""
        self.result = result
        self.logs, self.remarks, self.origin = list(logs), list(remarks), origin

    def __repr__(self) -> str:
        """The points as a number, as nbgrader reads them, or None when nobody could find out."""
        return "None" if self.result.points is None else f"{self.result.points:g}"

    def _repr_mimebundle_(self, **_: object) -> dict[str, str]:
        from autograder.report.html import check_html
        from autograder.report.terminal import check_text

        # nbgrader takes the points from the plain text, and all of them where that is no number.
        graded = "NBGRADER_EXECUTION" in os.environ
        return {
            "text/plain": repr(self) if graded else check_text(self.result, self.logs, self.remarks, self.origin),
            "text/html": check_html(self.result, "student", self.logs, self.remarks, self.origin),
        }


current = Session()
atexit.register(current.close)


def reset() -> None:
    """Start a new collection: a new cell begins."""
    current.reset()
