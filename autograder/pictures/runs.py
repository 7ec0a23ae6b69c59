"""Runs of callbacks: when each began and ended, on which thread, in which callback group."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass


@dataclass(frozen=True)
class Run:
    """One run of a callback. Times are seconds, from any common beginning."""

    callback: str
    begin: float
    end: float
    thread: int = 1
    """The threads of a program are numbered in the order in which they first ran a callback."""
    group: str = ""
    """The callback group in words, such as `default group, exclusive`."""
    node: str = ""
    ended: bool = True
    """False: it was still under way when it was last seen."""


class Runs(Sequence[Run]):
    """Runs of the callbacks of one launch, in the order in which they began.

    Args:
        runs: in any order.
    """

    def __init__(self, runs: Iterable[Run]) -> None:
        """Put them in order."""
        self._runs = tuple(sorted(runs, key=lambda run: (run.begin, run.end, run.callback)))

    def __len__(self) -> int:
        return len(self._runs)

    def __getitem__(self, index: int) -> Run:  # type: ignore[override]
        return self._runs[index]

    def __iter__(self) -> Iterator[Run]:
        return iter(self._runs)

    def __repr__(self) -> str:
        counts = ", ".join(f"{name}: {self.count(name)}" for name in self.callbacks())
        return f"runs of callbacks: {counts or 'none'}"

    def callbacks(self) -> list[str]:
        """Names of the callbacks, in the order in which they first ran."""
        return list(dict.fromkeys(run.callback for run in self._runs))

    def of(self, *callbacks: str) -> Runs:
        """Return the runs of these callbacks; of all of them if none is named."""
        return self._chosen(lambda run: not callbacks or run.callback in callbacks)

    def of_node(self, node: str) -> Runs:
        """Return the runs of the callbacks of one node, by its full name."""
        return self._chosen(lambda run: run.node == node)

    def between(self, begin: float, end: float) -> Runs:
        """Return the runs that were under way at some time from `begin` to `end`."""
        return self._chosen(lambda run: run.begin < end and run.end >= begin)

    def _chosen(self, wanted: Callable[[Run], bool]) -> Runs:
        return Runs(run for run in self._runs if wanted(run))

    def count(self, *callbacks: str) -> int:
        """How many runs of these callbacks began."""
        return len(self.of(*callbacks))

    def threads(self, *callbacks: str) -> set[int]:
        """The threads on which these callbacks ran."""
        return {run.thread for run in self.of(*callbacks)}

    def overlap(self, *callbacks: str) -> int:
        """How many runs of these callbacks were under way at once, at the most."""
        changes = sorted(change for run in self.of(*callbacks) for change in ((run.begin, 1), (run.end, -1)))
        return max(itertools.accumulate(change for _, change in changes), default=0)

    def longest_pause(self, callback: str) -> float:
        """The longest time from one begin of a callback to its next, in seconds; infinite if there is no next one."""
        begins = [run.begin for run in self.of(callback)]
        return max((later - earlier for earlier, later in itertools.pairwise(begins)), default=float("inf"))

    def longest(self, callback: str) -> float:
        """The longest time that one run of a callback took, in seconds."""
        return max((run.end - run.begin for run in self.of(callback)), default=0.0)
