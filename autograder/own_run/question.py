"""A question about a record, and the picture in which its answer can be seen."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

from pydantic import BaseModel, ConfigDict

from autograder import pictures
from autograder.graph.qos import mismatch_between
from autograder.own_run.record import SECONDS, Record
from autograder.pictures import Picture, Traffic


class Question(BaseModel):
    """A question that only this record answers. It does not hold its answer."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    kind: str
    """The name of the function in `keys` that finds its answer."""
    about: dict[str, str | int | float]
    """The arguments of this function."""
    text: str
    choices: tuple[str, ...] = ()
    """The possible answers; empty if the answer is a whole number."""
    view: Literal["timeline", "arrivals", "lifecycle", "qos"]
    """The picture to look at."""
    subject: str
    """The full name of the node or topic of the picture. A timeline without it shows all nodes."""

    def picture(self, record: Record) -> Picture:
        """Draw the picture in which the answer can be seen."""
        if self.view == "arrivals":
            rows = record.traffic[self.subject]
            return pictures.arrivals(self.subject, rows, seconds=_length(rows), start=0.0)
        if self.view == "qos":
            ends = [end for end in record.ends if end.topic == self.subject]
            return pictures.qos(self.subject, ends, lambda one, other: mismatch_between(one.policies, other.policies))
        if self.view == "lifecycle":
            return pictures.lifecycle(self.subject, pictures.steps(record.steps(self.subject)))
        runs = record.callbacks[self.subject] if self.subject else pictures.Runs(record.runs)
        return pictures.timeline(runs, seconds=min(SECONDS, max(run.end for run in runs) * 1.02), start=0.0)

    def is_drawn(self, record: Record) -> bool:
        """Whether the picture shows each message that the question is about: it leaves out strokes that would touch."""
        if self.view != "arrivals":
            return True
        rows = record.traffic[self.subject]
        begin, end = float(self.about.get("begin", 0.0)), float(self.about.get("end", SECONDS))
        asked = [row.who.endswith(" publishes") or row.who == self.about.get("who") for row in rows]
        drawn = pictures.drawn(rows, seconds=_length(rows), start=0.0)
        return all(
            time in shown
            for row, shown, is_asked in zip(rows, drawn, asked, strict=True)
            for time in row.times
            if is_asked and begin <= time <= end
        )


def _length(rows: Sequence[Traffic]) -> float:
    """Return the seconds that the picture of a topic shows."""
    return 1.05 * max((time for row in rows for time in row.times), default=0.1)
