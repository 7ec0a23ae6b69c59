"""What one launch of a student's programs did, as plain data: callbacks, messages, state changes and the graph."""

from __future__ import annotations

from pydantic import BaseModel, ConfigDict, Field, model_validator

from autograder.graph.qos import POLICIES
from autograder.pictures import Endpoint, Run, Runs, Traffic

SECONDS = 3.0
"""The length of a record, from the first thing that happened. Questions are about this time only."""
LONGEST = 60.0
"""Seconds after which nothing is kept. What happens between `SECONDS` and this only shows that something went on."""
MOST_RUNS = 400
_MOST_CALLBACKS = 40


class StateChange(BaseModel):
    """A step of a lifecycle node's state machine."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    node: str
    start: str
    goal: str
    time: float
    """Seconds from the beginning of the record."""


class Record(BaseModel):
    """One launch. All times are in seconds from the first thing that happened in it."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    recorded_by: str = ""
    """The grade_id of the check that launched the programs."""
    programs: tuple[str, ...] = ()
    runs: tuple[Run, ...] = Field(default=(), max_length=MOST_RUNS)
    traffic: dict[str, tuple[Traffic, ...]] = Field(default_factory=dict, max_length=60)
    """The messages of each topic, by its full name."""
    changes: tuple[StateChange, ...] = Field(default=(), max_length=200)
    nodes: tuple[str, ...] = Field(default=(), max_length=60)
    ends: tuple[Endpoint, ...] = Field(default=(), max_length=60)

    @model_validator(mode="after")
    def _within_time(self) -> Record:
        """Refuse times that no launch can have: a program can tell its probe anything."""
        runs = (time for run in self.runs for time in (run.begin, run.end))
        sent = (time for rows in self.traffic.values() for row in rows for time in row.times)
        starts = (row.since for rows in self.traffic.values() for row in rows if row.since is not None)
        for time in (*runs, *sent, *starts, *(change.time for change in self.changes)):
            if not 0 <= time <= LONGEST:
                raise ValueError(f"{time} is no time of a launch.")
        if not all(0 <= run.period < float("inf") for run in self.runs):
            raise ValueError("a period is no time")
        if len({run.callback for run in self.runs}) > _MOST_CALLBACKS:
            raise ValueError("the record has too many callbacks")
        if any(not end.action and end.policies.keys() != POLICIES for end in self.ends):
            raise ValueError("an end of a topic has other policies than the graph shows")
        return self

    def by(self, grade_id: str) -> Record:
        """Return this record as that of a check."""
        return self.model_copy(update={"recorded_by": grade_id})

    @property
    def callbacks(self) -> dict[str, Runs]:
        """The runs of each node that has run a callback, by the node's full name."""
        nodes = sorted({run.node for run in self.runs})
        return {node: Runs(run for run in self.runs if run.node == node) for node in nodes}

    def steps(self, node: str) -> list[tuple[str, str]]:
        """Return the states that a lifecycle node left and entered, one pair for each change, in their order."""
        return [(change.start, change.goal) for change in self.changes if change.node == node]

    def active(self, node: str) -> list[tuple[float, float]]:
        """Return when a lifecycle node became active, and when it was no longer active, once for each time.

        A node that was still active at the end of the record was active up to this end.
        """
        came = [change.time for change in self.changes if change.node == node and change.goal == "active"]
        left = [change.time for change in self.changes if change.node == node and change.start == "active"]
        return [(time, min((other for other in left if other > time), default=SECONDS)) for time in came]
