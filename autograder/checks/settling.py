"""When nothing new can be expected on the graph any more: a verdict that is decided need not wait for its deadline.

What decides is not that time went by. Each program must have said, through its probe, that its main thread has come to
spinning; all that it said it made must be on the observer's graph; and then nothing new may come for as long as its
slowest timer takes, and a while more; time in which others kept the programs from the CPUs does not count. Where that
evidence is missing, the deadline decides as ever.
"""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Sequence

from autograder.diagnosis.inside import read
from autograder.graph.names import node_of
from autograder.graph.observer import Observer
from autograder.sandbox.inside.probe.events import Event, ExecutorSeen, NodeSeen, ProbeFailed, Thing
from autograder.sandbox.running_program import RunningProgram

QUIET = 1.5
"""Seconds without anything new, besides the longest period of a timer: what timers' callbacks make is there then."""

_LOOK_EVERY = 0.2
"""Seconds between two looks."""


class Settling:
    """Watches whether the graph of a launch still grows, from now on.

    Args:
        observer: of the launch.
        programs: that were started.
    """

    def __init__(self, observer: Observer, programs: Sequence[RunningProgram]) -> None:
        """Begin to watch."""
        self._observer, self._programs = observer, list(programs)
        self._seen: object = None
        self._looked = 0.0
        self._since = time.monotonic()
        self._pause = QUIET
        self._complete = False

    def decided(self) -> bool:
        """Whether nothing more can be expected to come."""
        now = time.monotonic()
        if now - self._looked >= _LOOK_EVERY:
            self._looked = now
            self._look(now)
        if not self._complete or now - self._since <= self._pause:
            return False
        return now - self._since - self._observer.patience.kept(self._since) > self._pause

    def _look(self, now: float) -> None:
        told = [read(program.events()) for program in self._programs]
        nodes, topics = self._observer.nodes(), self._observer.topics()
        made = [sum(isinstance(event, NodeSeen) for event in events) for events in told]
        things = [[(thing.id, thing.destroyed) for thing in _things(events)] for events in told]
        seen = (nodes, topics, made, things)
        if seen != self._seen:
            self._seen, self._since = seen, now
        self._pause = QUIET + max((thing.period for events in told for thing in _things(events)), default=0.0)
        self._complete = bool(told) and all(
            program.running() and _spins(events) and shows_all(self._observer, events)
            for program, events in zip(self._programs, told, strict=True)
        )


def shows_all(observer: Observer, events: Sequence[Event]) -> bool:
    """Whether all that a program has said it made is on the graph as the observer sees it."""
    nodes = observer.nodes()
    if any(isinstance(event, NodeSeen) and not event.destroyed and event.name not in nodes for event in events):
        return False
    look = {"publisher": observer.publishers, "subscription": observer.subscriptions}
    made = Counter(
        (thing.kind, thing.name, thing.node) for thing in _things(events) if thing.kind in look and not thing.destroyed
    )
    return all(
        sum(node_of(end) == node for end in look[kind](topic)) >= many for (kind, topic, node), many in made.items()
    )


def _things(events: Sequence[Event]) -> list[Thing]:
    return [event for event in events if isinstance(event, Thing)]


def _spins(events: Sequence[Event]) -> bool:
    """Whether the program's main thread has come to spinning, and the probe sees all that it makes."""
    blind = any(isinstance(event, ProbeFailed) for event in events)
    return not blind and any(isinstance(event, ExecutorSeen) and event.main for event in events)
