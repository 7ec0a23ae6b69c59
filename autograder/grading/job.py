"""What stage A hands to the worker in the sandbox: one submission as text, and the trusted cells to run on it."""

from __future__ import annotations

from pydantic import BaseModel, ConfigDict, Field

from autograder.results import Isolation, Outcome

CELL_SECONDS = 120.0
"""Seconds after which a check cell is ended; all of them together have a limit too (`supervisor.SECONDS_PER_CHECK`)."""
STUCK_SECONDS = 30.0
"""Seconds more after which a cell that did not end is stuck in a call that no exception reaches: the worker ends."""


class Cell(BaseModel):
    """One trusted code cell of a lab, in the notebook's order."""

    model_config = ConfigDict(extra="forbid")

    grade_id: str
    title: str = ""
    """The nearest heading above it."""
    points: float | None = None
    """None: a set-up cell that is run but not graded."""
    source: str
    """With the hidden tests and their markers."""


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
    problems: list[Outcome] = Field(default_factory=list)
