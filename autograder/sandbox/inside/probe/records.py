"""The records of things and executors, and the current activity of each thread of the program."""

import _thread
import dataclasses
import threading
import time
import weakref
from typing import Any

from . import events, rclpy_names
from .writing import ledger, quiet


class Thing:
    """The record of a timer, subscription, service, client, publisher or action server, or of another callback."""

    dirty = False

    def __init__(self, about: events.ThingMade) -> None:
        """Begin without runs; `about` can be replaced later."""
        self.number = next(ledger.numbers)
        self.key = f"thing{self.number}"
        self.about = about
        self.runs = self.done = self.raised = self.most = 0
        self.last = 0.0
        self.running: dict[int, tuple[float, int]] = {}
        """For each current run: when it began, and on which thread."""
        self.threads: set[int] = set()
        self.awaits = events.Awaits()
        self.awaited = ""
        self.spent = 0.0

    def event(self) -> events.Thing:
        """Return the record's line in its current state."""
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
        """Note that a run begins, and return the number of the run."""
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
        """Note that a run has ended."""
        with ledger.lock:
            now = time.monotonic()
            began, thread = self.running.pop(run)
            ledger.ran(self.number, began, now, thread)
            self.spent += now - began
            self.done += 1
            self.raised += raised
        ledger.touch(self)

    def count(self) -> None:
        """Note that one more message was published, or one more request was sent."""
        with ledger.lock:
            self.runs += 1
            self.last = time.monotonic()
            self.threads.add(_thread.get_ident())
            ledger.ran(self.number, self.last, self.last, _thread.get_ident())
        ledger.touch(self)

    def note(self, **changes: Any) -> None:
        """Change the information about the thing."""
        self.about = dataclasses.replace(self.about, **changes)
        ledger.touch(self)


def thing_of(entity: Any) -> Thing | None:
    """Return the record of an object of rclpy if it is a known thing; otherwise None."""
    found = ledger.known.get(entity)
    return found if isinstance(found, Thing) else None


def group_of(group: Any, node: Any) -> dict[str, Any]:
    """Return the information about a thing's callback group, as fields of `ThingMade`."""
    if group is None:
        return {}
    return {
        "group": type(group).__name__,
        "group_id": id(group),
        "default_group": group is node.default_callback_group,
    }


def node_name(node: Any) -> str:
    """Return a node's full name, or "" if the node cannot return it."""
    with quiet():
        return str(node.get_fully_qualified_name())
    return ""


_MOST = 8
"""The number of executors whose records are written whenever any record is written."""


class Executor:
    """The record of an executor: which nodes it contains, whether it is spinning, how many callbacks it ran at once."""

    dirty = False

    def __init__(self, executor: Any) -> None:
        """Begin with an executor that was just created."""
        self.number = next(ledger.numbers)
        self.key = f"executor{self.number}"
        self.executor = weakref.ref(executor)
        self.threads_given: bool | None = None
        self.spins = self.spinning = self.main = self.busy = self.most = 0

    def event(self) -> events.ExecutorSeen:
        """Return the record's line in its current state."""
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
        """Note that one of its threads begins (1) or stops (-1) running a callback."""
        with ledger.lock:
            self.busy += change
            if self.busy > self.most:
                self.most = self.busy

    def spin(self, change: int, long: bool = False) -> None:
        """Note that it begins to spin (1), that it stops spinning (-1), or that its nodes have changed (0)."""
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
    """Return the record of an executor, and create it if there is none."""
    known: Executor | None = ledger.known.get(executor)
    if known is None:
        known = Executor(executor)
        ledger.add(known, executor)
        if len(ledger.always) < _MOST:
            ledger.always.append(known)
    return known


class ThreadState(threading.local):
    """The current activity of this thread."""

    callback: "Thing | None" = None
    """The callback that the thread is running."""
    taken: Any = None
    """The thing and the executor of the callback that rclpy is about to run."""
    depth = 0
    """The number of noted calls on the stack since the innermost callback began. It is more than 1 if rclpy calls
    itself."""
    building = False
    """Whether the thread is inside `Node.__init__`. Things that are created there are rclpy's own."""


here = ThreadState()
