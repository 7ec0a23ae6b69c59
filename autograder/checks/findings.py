"""What has been found out since the last score: the outcomes and logs that one check cell collects.

A check cell may launch several times; its score speaks for all of them. The collection is started afresh for each
cell.
"""

from __future__ import annotations

import time
from dataclasses import dataclass

from autograder.core.results import NodeLog, Outcome
from autograder.graph.patience import Patience


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
    """One cell's findings."""

    def __init__(self) -> None:
        """Begin with none."""
        self.alone = False
        """Whether these checks are run again, with nothing else of this kit beside them."""
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
        self.asked: list[Asked] = []
        """What the current launch has been sent."""
        self.finished: set[str] = set()
        """Titles of the parts that the current launch has finished with."""
        self.used: set[str] = set()
        """Names of the student's files that the check uses."""
        self.flags: list[str] = []
        """Contradictions between what the graph showed and what was seen inside the programs."""
        self.logs: list[NodeLog] = []
        self.patience = Patience(self.alone)
        """How much longer the waits of this check may still take on a busy machine."""
        self.starved = 0.0
        """Seconds that others withheld from the programs when something was decided against them."""
        self._began = time.monotonic()

    def begin_block(self) -> None:
        """A launch or a table begins."""
        self.block_began = len(self.outcomes)
        self.asked, self.finished = [], set()

    @property
    def seconds(self) -> float:
        """How long ago the cell, or what comes after its last score, began."""
        return time.monotonic() - self._began
