"""Which callbacks ran at the same time, from what they publish: `NAME begin` and `NAME end`.

A callback that may overlap itself numbers its runs: `NAME 7 begin` and `NAME 7 end`. The order of publication decides,
never a clock: a callback publishes its begin before its work and its end after it, so two callbacks overlap exactly
when one's begin lies between the other's begin and end.
"""

from __future__ import annotations

import itertools
from collections import Counter, defaultdict, deque
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

from autograder.graph.recording import Received


@dataclass(frozen=True)
class Span:
    """One complete run of a callback; the stamps are seconds of the publisher's system clock."""

    name: str
    begin: float
    end: float


@dataclass(frozen=True)
class _Event:
    name: str
    run: str
    """Name and number of the run; the name alone where runs are not numbered."""
    begins: bool
    stamp: float


class Concurrency:
    """The begins and ends on one topic of `std_msgs/String`."""

    def __init__(self, received: Sequence[Received]) -> None:
        """Put the messages in the order in which they were published."""
        self.messages = len(received)
        """How many messages it was made of."""
        self._stretches: list[tuple[Counter[str], list[_Event]]] = []
        last = None
        for item in sorted(received, key=lambda item: item.sequence):
            if last is None or item.sequence > last + 1:
                self._stretches.append((Counter(), []))
            last = item.sequence
            run, _, what = item.msg.data.rpartition(" ")
            if what in ("begin", "end"):
                name = run.partition(" ")[0]
                self._stretches[-1][1].append(_Event(name, run, what == "begin", item.stamp))
        for under_way, events in self._stretches:
            # What was published before the observer was matched is missing. An end without a begin tells that
            # this run was under way when the stretch began.
            balance: Counter[str] = Counter()
            for event in events:
                balance[event.run] += 1 if event.begins else -1
                under_way[event.run] = max(under_way[event.run], -balance[event.run])

    def _running(self) -> Iterator[Counter[str]]:
        """How many runs of each callback are under way, after each event."""
        for under_way, events in self._stretches:
            running: Counter[str] = Counter()
            for run, count in under_way.items():
                running[run.partition(" ")[0]] += count
            yield running
            for event in events:
                running[event.name] += 1 if event.begins else -1
                yield running

    def overlap(self, names: Iterable[str]) -> int:
        """How many runs of the named callbacks were under way at once, at the most."""
        wanted = set(names)
        return max((sum(running[name] for name in wanted) for running in self._running()), default=0)

    def distinct_overlap(self, names: Iterable[str]) -> int:
        """How many *different* ones of the named callbacks were under way at once, at the most."""
        wanted = set(names)
        return max((sum(1 for name in wanted if running[name]) for running in self._running()), default=0)

    def crossed(self, some: Iterable[str], others: Iterable[str]) -> bool:
        """Whether a callback of `some` was under way together with one of `others`."""
        left, right = set(some), set(others)
        return any(any(running[n] for n in left) and any(running[n] for n in right) for running in self._running())

    def runs(self, name: str) -> int:
        """Complete runs of one callback."""
        return sum(1 for span in self.spans() if span.name == name)

    def gaps(self, name: str) -> list[float]:
        """Seconds from each begin of a callback to its next one."""
        gaps = []
        for _, events in self._stretches:
            begins = [event.stamp for event in events if event.begins and event.name == name]
            gaps += [later - earlier for earlier, later in itertools.pairwise(begins)]
        return gaps

    def spans(self) -> list[Span]:
        """All complete runs."""
        return list(self._spans)

    @cached_property
    def _spans(self) -> list[Span]:
        done = []
        for under_way, events in self._stretches:
            unpaired = Counter(under_way)
            open_at: defaultdict[str, deque[float]] = defaultdict(deque)
            for event in events:
                if event.begins:
                    open_at[event.run].append(event.stamp)
                elif unpaired[event.run]:
                    unpaired[event.run] -= 1
                else:
                    done.append(Span(event.name, open_at[event.run].popleft(), event.stamp))
        return done
