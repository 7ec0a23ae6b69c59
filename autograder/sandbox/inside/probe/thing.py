"""The record of a thing whose callback an executor runs, or from which messages or requests are sent."""

import _thread
import dataclasses
import time
from typing import Any

from . import events
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
