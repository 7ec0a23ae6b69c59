"""The record of an executor."""

import threading
import time
import weakref
from typing import Any

from . import events, rclpy_names
from .writing import ledger

_MOST = 8
"""Executors that are written whenever anything is."""


class Executor:
    """An executor: which nodes it holds, whether it is spun, how many callbacks it ran at once."""

    dirty = False

    def __init__(self, executor: Any) -> None:
        """Begin with one that was just made."""
        self.number = next(ledger.numbers)
        self.key = f"executor{self.number}"
        self.executor = weakref.ref(executor)
        self.threads_given: bool | None = None
        self.spins = self.spinning = self.main = self.busy = self.most = 0

    def event(self) -> events.ExecutorSeen:
        """Return its line as it is now."""
        executor = self.executor()
        return events.ExecutorSeen(
            id=self.number,
            type=type(executor).__name__ if executor is not None else "",
            threads=rclpy_names.thread_count(executor),
            threads_given=self.threads_given,
            nodes=sorted(ledger.known[node].name for node in self._nodes() if node in ledger.known),
            spins=self.spins,
            spinning=self.spinning > 0,
            main=self.main > 0,
            busy=self.busy,
            most=self.most,
        )

    def step(self, change: int) -> None:
        """Note that a callback came onto a thread of it (1), or left it (-1)."""
        with ledger.lock:
            self.busy += change
            if self.busy > self.most:
                self.most = self.busy

    def spin(self, change: int, long: bool = False) -> None:
        """Note that something began to spin it (1), or ended that (-1), or that its nodes have changed (0)."""
        with ledger.lock:
            if long and threading.current_thread() is threading.main_thread():
                self.main += change
            self.spinning += max(change, 0)
            self.spins += change > 0
        for node in self._nodes():
            self._mark(node)
        with ledger.lock:
            self.spinning += min(change, 0)
        ledger.touch(self)

    def _nodes(self) -> list[Any]:
        executor = self.executor()
        return [] if executor is None else rclpy_names.nodes_of(executor)

    def _mark(self, node: Any) -> None:
        known = ledger.known.get(node)
        if self.spinning and known is not None:
            known.spun = time.monotonic()
            ledger.touch(known)


def executor_of(executor: Any) -> Executor:
    """Return the record of an executor, made now if there is none."""
    known: Executor | None = ledger.known.get(executor)
    if known is None:
        known = Executor(executor)
        ledger.add(known, executor)
        if len(ledger.always) < _MOST:
            ledger.always.append(known)
    return known
