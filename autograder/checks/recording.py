"""Records what a launch did, for questions about a student's own run. Nothing of this gives or takes points."""

from __future__ import annotations

import re
import time
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from autograder.checks import picture_data
from autograder.diagnosis.inside import Inside
from autograder.graph.lifecycle import in_order
from autograder.own_run.record import LONGEST, MOST_RUNS, SECONDS, Record, StateChange
from autograder.pictures import Run, Traffic

if TYPE_CHECKING:
    from autograder.checks.running_launch import RunningLaunch

_NUMBER = re.compile(r" \(\d+\)$")
_DIGITS = 4
"""Decimal places of a second that are kept."""


def record(running: RunningLaunch, insides: Sequence[Inside]) -> Record:
    """Return what a launch has done so far, from its first callback or message on.

    Args:
        running: the launch, whose programs still run.
        insides: its programs as their probes show them.
    """
    known = [run for run in picture_data.runs(insides) if run.node and run.known]
    runs = _named_in_their_node(known)
    things = [thing for inside in insides for thing in inside.things.values()]
    topics = sorted({thing.name for thing in things if thing.kind in ("publisher", "subscription") and thing.node})
    traffic = {topic: picture_data.traffic(insides, topic) for topic in topics if not topic.startswith("/rosout")}
    # State changes have stamps of the system clock, and everything else has times of the monotonic clock.
    ahead = time.time() - time.monotonic()
    changes = [
        StateChange(node=change.node, start=change.start, goal=change.goal, time=change.stamp - ahead)
        for change in in_order(running.lifecycle_clients.values())
    ]
    begins = [run.begin for run in runs] + [time for rows in traffic.values() for row in rows for time in row.times]
    zero = min([*begins, *(change.time for change in changes)], default=0.0)
    graph = picture_data.graph(running.observer)
    return Record(
        programs=tuple(dict.fromkeys(described.program for described, _ in running.programs)),
        runs=tuple(_moved(run, zero) for run in runs[:MOST_RUNS] if run.begin - zero < SECONDS),
        traffic={topic: tuple(_within(row, zero) for row in rows) for topic, rows in traffic.items()},
        changes=tuple(
            change.model_copy(update={"time": round(change.time - zero, _DIGITS)})
            for change in changes[:200]
            if change.time - zero < LONGEST
        ),
        nodes=tuple(graph.nodes),
        ends=tuple(graph.endpoints),
    )


def _named_in_their_node(runs: Sequence[Run]) -> list[Run]:
    """Return the runs without the number of a callback whose name no other callback of its node has."""
    names = {(run.node, run.callback) for run in runs}
    plain = {name: _NUMBER.sub("", name[1]) for name in names}
    alone = {name for name in names if sum(n[0] == name[0] and plain[n] == plain[name] for n in names) == 1}
    return [
        replace(run, callback=plain[run.node, run.callback]) if (run.node, run.callback) in alone else run
        for run in runs
    ]


def _moved(run: Run, zero: float) -> Run:
    return replace(run, begin=round(run.begin - zero, _DIGITS), end=min(round(run.end - zero, _DIGITS), LONGEST))


def _within(row: Traffic, zero: float) -> Traffic:
    times = [round(time - zero, _DIGITS) for time in row.times if time - zero < SECONDS]
    since = None if row.since is None else round(row.since - zero, _DIGITS)
    return Traffic(row.who, times, since if since is not None and 0 <= since < SECONDS else None)
