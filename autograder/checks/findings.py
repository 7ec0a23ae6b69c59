"""What has been found out since the last score: the outcomes and logs that one check cell collects.

A check cell may launch several times; its score speaks for all of them. One process runs one cell at a time, so
there is one current collection, and it is started afresh for each cell.
"""

from __future__ import annotations

import time

from autograder.core.results import NodeLog, Outcome
from autograder.graph.observer import PATIENCE


class Findings:
    """One cell's findings."""

    def __init__(self) -> None:
        """Begin with none."""
        self.reset()

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
        self.patience = PATIENCE
        """Seconds that the waits of this check may still take longer on a busy machine."""
        self._began = time.monotonic()

    @property
    def seconds(self) -> float:
        """How long ago the cell, or what comes after its last score, began."""
        return time.monotonic() - self._began


current = Findings()
