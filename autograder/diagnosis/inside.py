"""What is known about one program from inside: its probe's events, its threads' stacks, its source."""

from __future__ import annotations

import re
import time
from collections.abc import Iterable, Sequence
from functools import cached_property
from pathlib import Path
from typing import Annotated, Any, TypeVar

from pydantic import Field, TypeAdapter, ValidationError

from autograder.arguments.rule_effect import full_name
from autograder.diagnosis import sources
from autograder.graph.observer import Observer
from autograder.sandbox.inside.probe.events import (
    Attached,
    Call,
    CallbackError,
    Event,
    ExecutorSeen,
    NodeSeen,
    ParameterSeen,
    ProbeFailed,
    Thing,
    ThreadError,
)
from autograder.sandbox.running_program import RunningProgram

_READER: TypeAdapter[Event] = TypeAdapter(Annotated[Event, Field(discriminator="e")])


def read(lines: Iterable[dict[str, Any]]) -> list[Event]:
    """Return the lines that have the form of an event, in their order.

    Other lines are ignored, because a student's program can write anything.
    """
    found = []
    for line in lines:
        try:
            found.append(_READER.validate_python(line))
        except ValidationError:
            continue
    return found


AFTER_SHUTDOWN = re.compile(
    r"Context must be initialized|context is (invalid|not valid)|NotInitializedException|ExternalShutdownException"
    r"|InvalidHandle|already called|'NoneType' object does not support the context manager"
)
"""The errors of rclpy in code that continues to use it after a shutdown."""


def events_of(program: RunningProgram) -> list[Event]:
    """Return what the probe of a program noted, without the errors that a signal from the check has caused.

    A signal that asks the program to end shuts down rclpy at once (`signal_handler.cpp` of rclpy 7.1). A callback that
    is just running then fails when it publishes, which is no mistake of the program's.
    """
    noted = read(program.events())
    if not program.told_to_end:
        return noted
    errors = (CallbackError, ThreadError)
    return [one for one in noted if not (isinstance(one, errors) and AFTER_SHUTDOWN.search(f"{one.type}: {one.text}"))]


_T = TypeVar("_T")


class Inside:
    """One program as its probe shows it. If the probe could not attach, nothing is known about the program."""

    def __init__(self, program: RunningProgram, folder: Path, observer: Observer) -> None:
        """Read the program's events.

        Args:
            program: the program.
            folder: the folder with its source.
            observer: the observer of the graph of its launch.
        """
        self.folder, self.observer = folder, observer
        self.program = program
        self.name = program.name
        self.now = time.monotonic()
        self.events: list[Event] = events_of(program)
        self.attached = bool(self.all(Attached)) and not self.all(ProbeFailed)
        self.things: dict[int, Thing] = {thing.id: thing for thing in self.all(Thing)}
        self.executors: list[ExecutorSeen] = self.all(ExecutorSeen)
        self.nodes: dict[str, NodeSeen] = {node.name: node for node in self.all(NodeSeen)}
        self.calls: list[Call] = self.all(Call)
        self.parameters: list[ParameterSeen] = self.all(ParameterSeen)

    def all(self, kind: type[_T]) -> list[_T]:
        """Return the events of one kind, in their order."""
        return [event for event in self.events if isinstance(event, kind)]

    @property
    def alive(self) -> bool:
        """Whether the program is running and its probe sees everything: it is attached and has not failed."""
        return self.attached and self.program.running()

    @property
    def age(self) -> float:
        """Seconds since the program was started."""
        return self.now - self.program.began

    @property
    def callbacks(self) -> list[Thing]:
        """The timers, subscriptions and services that have not been destroyed."""
        return [thing for thing in self.things.values() if thing.has_callback and not thing.destroyed]

    @property
    def names_in_code(self) -> dict[str, set[str]] | None:
        """The full names that the code gives to topics, before any rule is applied, with their nodes.

        None if not all names are known.
        """
        ends = [thing for thing in self.things.values() if thing.kind in ("publisher", "subscription")]
        if not self.attached or not all(thing.given and thing.node for thing in ends):
            return None
        found: dict[str, set[str]] = {}
        for thing in ends:
            found.setdefault(full_name(thing.given, thing.node), set()).add(thing.node)
        return found

    def group(self, thing: Thing) -> list[Thing]:
        """Return everything in the same callback group, including the thing itself and clients."""
        return [other for other in self.things.values() if thing.group_id and other.group_id == thing.group_id]

    def executor_of(self, node: str) -> ExecutorSeen | None:
        """Return the executor that contains a node."""
        return next((executor for executor in self.executors if node in executor.nodes), None)

    def spinning(self, node: str) -> bool:
        """Whether an executor that is spinning now contains the node."""
        return any(executor.spinning and node in executor.nodes for executor in self.executors)

    @cached_property
    def stacks(self) -> list[sources.Stacks]:
        """The stacks of the threads, read several times."""
        return sources.look(self.program)

    @cached_property
    def source(self) -> sources.Source:
        """The source of the program."""
        return sources.Source(self.folder / f"{self.name}.py")

    def place(self, thread: int) -> sources.Place | None:
        """Return where this thread is in the student's own code, in the callback that runs on it."""
        return self.source.place(self.name, [stacks.get(thread, []) for stacks in self.stacks])

    def turn(self, thread: int) -> sources.Place | None:
        """Return where in the student's own code this thread waits to take a lock or the like."""
        return self.source.turn(self.name, [stacks.get(thread, []) for stacks in self.stacks]) if self.stacks else None

    def held_since(self, thread: int, what: str) -> int:
        """The line since which this thread, which waits to take a thing, holds this thing itself; 0 if none is seen."""
        looks = [stacks.get(thread, []) for stacks in self.stacks]
        return self.source.held_since(self.name, looks, what)

    def main_place(self) -> sources.Place | None:
        """Return where the program's main thread is in the student's own code."""
        return self.source.place(self.name, self._mains(), True)

    def constructor_place(self) -> sources.Place | None:
        """Return where the program's main thread is in the constructor of a node, which may have called other code."""
        looks = [self.source.from_constructor(self.name, frames) for frames in self._mains()]
        return self.source.place(self.name, looks, True)

    def main_in_rclpy(self) -> bool:
        """Whether the program's main thread is inside a call into rclpy that the student's own code made."""
        mains = self._mains()
        return bool(mains) and all(sources.inside_rclpy(self.name, frames) for frames in mains)

    def _mains(self) -> list[list[sources.Frame]]:
        return [next(reversed(stacks.values()), []) for stacks in self.stacks]


def called(thing: Thing) -> str:
    """Describe a callback in words that a student knows: `the timer of `tick` (line 12, every 0.5 s)`."""
    function = re.match(r"(?:async )?def (\w+)", thing.code)
    if thing.kind == "timer":
        of = f" of `{function[1]}`" if function else ""
        return f"the timer{of} (line {thing.made.rpartition(':')[2]}, every {thing.period:g} s)"
    if thing.kind in ("execute", "goal", "cancel", "accepted"):
        return f"the {thing.kind} callback of the action `{thing.name}`"
    if thing.name:
        return f"the {thing.kind} `{thing.name}`"
    return f"the {thing.kind or 'other'} callback{f' in {thing.line}' if thing.line else ''}"


def listed(things: Sequence[Thing]) -> str:
    """Describe several callbacks as a list in words."""
    names = [called(thing) for thing in things]
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}"
