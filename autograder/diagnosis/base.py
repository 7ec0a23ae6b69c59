"""What a diagnosis is, and what it may look at."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

from autograder.graph.observer import Observer

if TYPE_CHECKING:
    from autograder.diagnosis.inside import Inside

RECORDS_FOLLOW = 0.3
"""Seconds after which what the probes have counted is written."""


@dataclass(frozen=True)
class Diagnosis:
    """Why something did not happen: established, or what was observed instead of a reason."""

    because: str
    """One or two sentences for the student."""
    code: str
    """A short stable word for the reason."""
    hint: str = ""
    """What to do or where to read on."""


class RunningProgram(Protocol):
    """What a diagnosis needs of a program."""

    name: str
    began: float

    def running(self) -> bool:
        """Whether it is alive."""

    def exit_status(self) -> int | None:
        """None while it runs; negative: the signal that ended it."""

    def stopped_by(self) -> str:
        """The limit that ended it, if one did."""

    def output(self) -> str:
        """What it printed."""

    def events(self) -> list[dict[str, Any]]:
        """What its probe wrote."""

    def stacks(self, timeout: float = 1.0) -> str:
        """Where its threads are."""


@dataclass(frozen=True)
class Scene:
    """The launch that is looked at."""

    observer: Observer
    programs: Sequence[RunningProgram]
    missing: Sequence[str]
    """Programs that should have been launched, but that no cell defines."""
    folder: Path
    """Where the programs' sources are."""
    rules: Sequence[Sequence[str]] = ()
    """The remap rules given to each of the programs, as on the command line."""
    trouble: Sequence[Diagnosis] = field(default=())
    """What kept programs from being started at all."""
    stopped: Sequence[RunningProgram] = ()
    """Programs that the check itself has ended."""

    @cached_property
    def insides(self) -> list[Inside]:
        """What each program's probe says, in the order of the programs."""
        from autograder.diagnosis.inside import Inside

        if any(program.running() for program in self.programs):
            self.observer.pause(RECORDS_FOLLOW)
        return [Inside(self, program) for program in self.programs]

    def inside_of(self, node: str) -> list[Inside]:
        """The programs that have this node, by what their probes say; all of them where no probe knows it."""
        return [inside for inside in self.insides if node in inside.nodes] or self.insides

    def rules_for(self, node: str) -> Sequence[str]:
        """The remap rules of the program that has this node; those of the only program where no node is meant."""
        if len(self.programs) == 1 and self.rules:
            return self.rules[0]
        for inside, rules in zip(self.insides, self.rules, strict=False):
            if node and node in inside.nodes:
                return rules
        return ()


def first(links: Iterable[Callable[[Inside], Diagnosis | None]], insides: Sequence[Inside]) -> Diagnosis | None:
    """What the first link that has seen enough says; programs are asked one after the other, links in their order."""
    for inside in insides:
        for link in links:
            found = link(inside)
            if found:
                return found
    return None
