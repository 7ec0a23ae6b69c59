"""What a diagnosis may look at: a launch, from outside and from inside."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

from autograder.diagnosis.inside import Inside
from autograder.graph.observer import Observer
from autograder.reasons import Reason
from autograder.sandbox.running_program import RunningProgram

RECORDS_FOLLOW = 0.3
"""Seconds after which what the probes have counted is written."""


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
    parameter_rules: Sequence[Sequence[str]] = ()
    """The parameter rules typed for each of the programs."""
    parameters: Sequence[Collection[str]] = ()
    """The names of the parameters given to each of the programs by the check."""
    trouble: Sequence[Reason] = field(default=())
    """What kept programs from being started at all."""
    stopped: Sequence[RunningProgram] = ()
    """Programs that the check itself has ended."""

    @cached_property
    def insides(self) -> list[Inside]:
        """What each program's probe says, in the order of the programs."""
        if any(program.running() for program in self.programs):
            self.observer.pause(RECORDS_FOLLOW)
        return [self.inside(program) for program in self.programs]

    def inside(self, program: RunningProgram) -> Inside:
        """What one program's probe says now."""
        return Inside(program, self.folder, self.observer)

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


def first(links: Iterable[Callable[[Inside], Reason | None]], insides: Sequence[Inside]) -> Reason | None:
    """What the first link that has seen enough says; programs are asked one after the other, links in their order."""
    for inside in insides:
        for link in links:
            found = link(inside)
            if found:
                return found
    return None
