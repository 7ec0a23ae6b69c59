"""What has been found out since the last score: the outcomes and logs that one check cell collects.

A check cell may launch several times; its score speaks for all of them. One process runs one cell at a time, so
there is one current collection, and it is started afresh for each cell.
"""

from __future__ import annotations

import atexit
import itertools
import random
import socket
import time
from pathlib import Path

from autograder.results import CheckResult, Isolation, NodeLog, Outcome
from autograder.sandbox.nodes import NodeSandbox

NOTEBOOK_FOLDER = Path("nodes")
"""Where a student's notebook keeps the files that its `%%node` and `%%file` cells write."""

_DDS_PORT = 7400
_DDS_PORTS_PER_DOMAIN = 250


class Session:
    """The current cell's findings and the sandbox that its programs run in."""

    def __init__(self) -> None:
        """Start as a student's notebook does: programs beside the notebook, no isolation from oneself."""
        self.folder = NOTEBOOK_FOLDER
        self.isolation = Isolation.NONE
        self.random = random.Random()
        self._sandbox: NodeSandbox | None = None
        self._domains = itertools.cycle(random.sample(range(1, 100), 99))
        self.reset()

    def configure(self, folder: Path, isolation: Isolation, seed: int) -> None:
        """Say where the programs are and how they are kept apart; the grading worker does so once.

        Args:
            folder: holds the programs and files of the submission.
            isolation: for the programs.
            seed: of all values that vary from run to run.
        """
        self.close()
        self.folder, self.isolation, self.random = folder, isolation, random.Random(seed)

    def reset(self) -> None:
        """Forget the findings so far: a new cell begins."""
        self.outcomes: list[Outcome] = []
        self.part = ""
        """Title of the part of the check that is being looked at."""
        self.lost_parts: set[str] = set()
        """Parts of launches that failed as a whole, or outside of any part."""
        self.block_began = 0
        """Number of the first outcome of the current launch or table."""
        self.logs: list[NodeLog] = []
        self.scored_logs: list[NodeLog] = []
        """Logs of what has been scored since the cell began."""
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
    """A check's result as the last expression of its cell: the `repr` is the points, the HTML is the report."""

    def __init__(self, result: CheckResult) -> None:
        """Wrap a result for display."""
        self.result = result

    def __repr__(self) -> str:
        """The points as a number, as nbgrader reads them, or None when nobody could find out."""
        return "None" if self.result.points is None else f"{self.result.points:g}"

    def _repr_html_(self) -> str:
        from autograder.report.html import check_html

        return check_html(self.result, audience="student")


current = Session()
atexit.register(current.close)


def reset() -> None:
    """Start a new collection: a new cell begins."""
    current.reset()
