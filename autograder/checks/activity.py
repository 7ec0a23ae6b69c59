"""Which callbacks ran at the same time, from what they publish: `NAME begin` and `NAME end`.

The order of publication decides, never a clock: a callback publishes its begin before its work and its end after it, so
two callbacks overlap exactly when one's begin lies between the other's begin and end.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from autograder.graph.recording import Received


@dataclass(frozen=True)
class Span:
    """One complete run of a callback; the stamps are seconds of the publisher's system clock."""

    name: str
    begin: float
    end: float


class Activity:
    """The begins and ends on one topic of `std_msgs/String`."""

    def __init__(self, received: Sequence[Received]) -> None:
        """Put the messages in the order in which they were published."""
        ordered = sorted(received, key=lambda item: item.sequence)
        self.events = [(item.msg.data.rpartition(" "), item.stamp) for item in ordered]

    def overlap(self, names: Iterable[str]) -> int:
        """How many runs of the named callbacks were under way at once, at the most."""
        wanted, running, most = set(names), Counter[str](), 0
        for (name, _, what), _stamp in self.events:
            if name in wanted:
                if what == "begin":
                    running[name] += 1
                elif running[name]:
                    running[name] -= 1
                most = max(most, running.total())
        return most

    def distinct_overlap(self, names: Iterable[str]) -> int:
        """How many *different* ones of the named callbacks were under way at once, at the most."""
        wanted, running, most = set(names), Counter[str](), 0
        for (name, _, what), _stamp in self.events:
            if name in wanted:
                if what == "begin":
                    running[name] += 1
                elif running[name]:
                    running[name] -= 1
                most = max(most, sum(1 for count in running.values() if count))
        return most

    def crossed(self, some: Iterable[str], others: Iterable[str]) -> bool:
        """Whether a callback of `some` was under way together with one of `others`."""
        left, right, running = set(some), set(others), Counter[str]()
        for (name, _, what), _stamp in self.events:
            if name in left | right:
                running[name] += 1 if what == "begin" else -min(1, running[name])
                if any(running[n] for n in left) and any(running[n] for n in right):
                    return True
        return False

    def runs(self, name: str) -> int:
        """Complete runs of one callback."""
        return sum(1 for span in self.spans() if span.name == name)

    def spans(self) -> list[Span]:
        """All complete runs; a callback that overlaps itself is paired first begin, first end."""
        open_at: dict[str, list[float]] = {}
        done = []
        for (name, _, what), stamp in self.events:
            if what == "begin":
                open_at.setdefault(name, []).append(stamp)
            elif what == "end" and open_at.get(name):
                done.append(Span(name, open_at[name].pop(0), stamp))
        return done
