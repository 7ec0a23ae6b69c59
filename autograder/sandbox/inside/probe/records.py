"""The records of things and executors, and what each thread of the program is doing."""

import _thread
import dataclasses
import threading
import time
import weakref
from typing import Any

from . import events, rclpy_names
from .writing import ledger, quiet


class Thing:
    """A timer, subscription, service, client, publisher or action server, or another kind of callback."""

    dirty = False

    def __init__(self, about: events.ThingMade) -> None:
        """Begin with no run; `about` may change."""
        self.number = next(ledger.numbers)
        self.key = f"thing{self.number}"
        self.about = about
        self.runs = self.done = self.raised = self.most = 0
        self.last = 0.0
        self.running: dict[int, tuple[float, int]] = {}
        """Run -> since when, and on which thread it began."""
        self.threads: set[int] = set()
        self.awaits = events.Awaits()
        self.awaited = ""
        self.spent = 0.0

    def event(self) -> events.Thing:
        """Return its line as it is now."""
        return events.Thing(
            id=self.number,
            **vars(self.about),
            runs=self.runs,
            done=self.done,
            raised=self.raised,
            most=self.most,
            last=self.last,
            running=list(self.running.values())[:16],
            threads=len(self.threads),
            awaits=self.awaits,
            awaited=self.awaited,
            spent=self.spent,
        )

    def begin(self) -> int:
        """Note that a run of it begins; return its number."""
        with ledger.lock:
            self.runs += 1
            run = self.runs
            self.last = time.monotonic()
            self.running[run] = (self.last, _thread.get_ident())
            self.most = max(self.most, len(self.running))
            self.threads.add(_thread.get_ident())
        ledger.touch(self)
        return run

    def end(self, run: int, raised: bool) -> None:
        """Note that a run of it is over."""
        with ledger.lock:
            now = time.monotonic()
            began, thread = self.running.pop(run)
            ledger.ran(self.number, began, now, thread)
            self.spent += now - began
            self.done += 1
            self.raised += raised
        ledger.touch(self)

    def count(self) -> None:
        """Note one more message published, or request sent."""
        with ledger.lock:
            self.runs += 1
            self.last = time.monotonic()
            self.threads.add(_thread.get_ident())
            ledger.ran(self.number, self.last, self.last, _thread.get_ident())
        ledger.touch(self)

    def note(self, **changes: Any) -> None:
        """Change what is known about it."""
        self.about = dataclasses.replace(self.about, **changes)
        ledger.touch(self)


def thing_of(entity: Any) -> Thing | None:
    """Return the record of an object of rclpy, if it is a thing and is known."""
    found = ledger.known.get(entity)
    return found if isinstance(found, Thing) else None


def group_of(group: Any, node: Any) -> dict[str, Any]:
    """Return what a thing's record says of its callback group, as fields of `ThingMade`."""
    if group is None:
        return {}
    return {
        "group": type(group).__name__,
        "group_id": id(group),
        "default_group": group is node.default_callback_group,
    }


def node_name(node: Any) -> str:
    """Return a node's full name; "" where it does not say."""
    with quiet():
        return str(node.get_fully_qualified_name())
    return ""


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


class ThreadState(threading.local):
    """What this thread is doing."""

    callback: "Thing | None" = None
    """The callback that it runs."""
    taken: Any = None
    """(thing, executor) of the callback that rclpy is about to run."""
    depth = 0
    """How many noted calls of rclpy are on the stack since the innermost callback began: rclpy calls itself."""
    building = False
    """Inside `Node.__init__`: what is made there is rclpy's own."""


here = ThreadState()
