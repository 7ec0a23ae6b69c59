"""The history of a submission's points: when it was graded, with which versions, and what changed the points and why.

The gradebook stores entries, and each holds only what was different from before. `told` compares every entry with those
before it and says in words what changed.
"""

from __future__ import annotations

import datetime
from collections.abc import Sequence
from dataclasses import dataclass, field
from enum import StrEnum

from pydantic import BaseModel, ConfigDict


class _Model(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class Points(_Model):
    """The points of one cell in the gradebook."""

    auto: float | None
    """The points of the check; None if there is no verdict, or if only a person gives points for the cell."""
    by_hand: float | None
    """The points that a person gave instead."""
    extra: float | None
    """Extra credit that a person gave."""
    most: float
    """The most points that the cell can get without extra credit."""
    is_check: bool

    @property
    def given(self) -> float | None:
        """The points that count; None if a person has yet to grade the cell."""
        points = self.auto if self.by_hand is None else self.by_hand
        return None if points is None else points + (self.extra or 0.0)


class Graded(_Model):
    """What was graded, and with what."""

    kit: str
    """The version of the kit."""
    kit_digest: str
    lab_digest: str
    checks: dict[str, str]
    """A digest of each check, by grade_id."""
    answers: str
    """A digest of what the student handed in."""
    handed_in: str
    """The date and time of the submission; empty if they are not known."""
    recorded: str
    """A digest of everything that was recorded."""


class Decision(StrEnum):
    """The answer to an appeal."""

    GRANTED = "granted"
    REFUSED = "refused"


class Decided(_Model):
    """An appeal and the answer to it."""

    cell: str
    asked: str
    """The student's sentence."""
    decision: Decision
    reason: str
    """The instructor's reason, which the student reads."""


class Entry(_Model):
    """Something that happened to a submission."""

    at: datetime.datetime
    by: str
    """The user who ran the program that noted this."""
    points: dict[str, Points] = {}
    """The points of the cells that have other points than before, by grade_id."""
    penalty: float | None = None
    """The points that are taken off for being late; None if they are as before."""
    graded: Graded | None = None
    """What was graded; None if nothing was graded."""
    decided: Decided | None = None


@dataclass(frozen=True)
class Change:
    """A change of the points of one cell, or of the penalty, in words."""

    cell: str
    """The grade_id; empty for the penalty."""
    before: str
    after: str
    why: str


@dataclass(frozen=True)
class Event:
    """An entry in words."""

    at: datetime.datetime
    by: str
    what: str
    score: str
    """The points after it, as in `7 of 9`."""
    changes: tuple[Change, ...]


@dataclass
class State:
    """The points of a submission after some entries."""

    points: dict[str, Points] = field(default_factory=dict)
    penalty: float = 0.0
    graded: Graded | None = None

    def take(self, entry: Entry) -> None:
        """Apply an entry."""
        self.points.update(entry.points)
        self.penalty = self.penalty if entry.penalty is None else entry.penalty
        self.graded = entry.graded or self.graded

    @property
    def score(self) -> str:
        """The points in words."""
        earned = max(0.0, sum(points.given or 0.0 for points in self.points.values()) - self.penalty)
        return f"{_number(earned)} of {_number(sum(points.most for points in self.points.values()))}"


def state_after(entries: Sequence[Entry]) -> State:
    """Return the points of a submission after some entries, in the order in which they were written."""
    state = State()
    for entry in entries:
        state.take(entry)
    return state


def told(entries: Sequence[Entry], cell: str = "") -> list[Event]:
    """Return what happened, in words.

    Args:
        entries: the entries of a submission in the order in which they were written.
        cell: the grade_id of the cell that this is about; empty for the whole submission.
    """
    events, state = [], State()
    for entry in entries:
        before = State(dict(state.points), state.penalty, state.graded)
        state.take(entry)
        changes = tuple(change for change in _changes(before, entry, cell) if cell in ("", change.cell))
        about = "" if entry.decided is None or cell not in ("", entry.decided.cell) else _appeal(entry.decided)
        what = ". ".join(filter(None, [_graded(before.graded, entry.graded), about]))
        if what or changes:
            what = what or ("Points by hand" if entry.points else "Handed in late")
            events.append(Event(entry.at, entry.by, what, state.score, changes))
    return events


def _graded(before: Graded | None, now: Graded | None) -> str:
    if now is None:
        return ""
    handed_in = f", handed in {now.handed_in}" if now.handed_in else ""
    versions = f"lab {now.lab_digest[:8]}, kit {now.kit} ({now.kit_digest[:8]})"
    return f"Graded{' again' if before is not None else ''} with {versions}{handed_in}"


def _appeal(decided: Decided) -> str:
    return f"Appeal about {decided.cell} {decided.decision.value}: {decided.reason}"


def _changes(before: State, entry: Entry, cell: str) -> list[Change]:
    changes = []
    for name, now in entry.points.items():
        was = before.points.get(name)
        # The first grading gives points to every cell, so the points of each are told only where it is the subject.
        if was is None and before.graded is None and entry.graded is not None and not cell:
            continue
        why = "; ".join(_why(name, was, now, before.graded, entry.graded))
        if why:
            changes.append(Change(name, _points(was), _points(now), why))
    if entry.penalty is not None and entry.penalty != before.penalty:
        changes.append(Change("", _number(0 - before.penalty), _number(0 - entry.penalty), "penalty for being late"))
    return changes


def _why(name: str, was: Points | None, now: Points, before: Graded | None, graded: Graded | None) -> list[str]:
    """Return the reasons why a cell has other points than before."""
    if was is None:
        return ["new in the lab" if before is not None else "graded for the first time"]
    reasons = []
    if now.most != was.most:
        reasons.append(f"it gives up to {_number(now.most)} points now, before {_number(was.most)}")
    if now.auto != was.auto:
        reasons.append(_why_other_verdict(name, before, graded))
        if now.by_hand is not None:
            reasons[-1] += f", the check gives {_points_of(now.auto)} now, but the points by hand stay"
    if now.by_hand != was.by_hand:
        given = "overruled by hand" if now.is_check else "graded by hand"
        reasons.append(
            "points by hand taken back" if now.by_hand is None else given if was.by_hand is None else "changed by hand"
        )
    if (now.extra or 0.0) != (was.extra or 0.0):
        reasons.append(f"extra credit by hand, {_number(now.extra or 0.0)}")
    return reasons


def _why_other_verdict(name: str, before: Graded | None, graded: Graded | None) -> str:
    if before is None or graded is None:
        return "graded"
    reasons = []
    if before.answers != graded.answers:
        reasons.append("resubmission")
    if before.checks.get(name) != graded.checks.get(name):
        reasons.append("changed check")
    elif before.kit_digest != graded.kit_digest:
        reasons.append("changed kit")
    return " and ".join(reasons) or "graded again"


def _points(points: Points | None) -> str:
    return "none" if points is None else f"{_points_of(points.given)} of {_number(points.most)}"


def _points_of(points: float | None) -> str:
    return "?" if points is None else _number(points)


def _number(points: float) -> str:
    return f"{round(points, 2):g}"


def decisions(entries: Sequence[Entry]) -> dict[str, Decided]:
    """Return the last answer to an appeal about each cell, by grade_id."""
    return {entry.decided.cell: entry.decided for entry in entries if entry.decided is not None}
