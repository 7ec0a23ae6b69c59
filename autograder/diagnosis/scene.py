"""The information that a diagnosis may use: a launch, seen from outside and from inside."""

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
"""The seconds after which the probes have written what they counted."""


@dataclass(frozen=True)
class Scene:
    """The launch that is diagnosed."""

    observer: Observer
    programs: Sequence[RunningProgram]
    missing: Sequence[str]
    """The programs that should have been launched, but that no cell defines."""
    folder: Path
    """The folder with the programs' sources."""
    rules: Sequence[Sequence[str]] = ()
    """The remap rules that were given to each of the programs, as on the command line."""
    parameter_rules: Sequence[Sequence[str]] = ()
    """The parameter rules that were typed for each of the programs."""
    parameters: Sequence[Collection[str]] = ()
    """The names of the parameters that the check gave to each of the programs."""
    trouble: Sequence[Reason] = field(default=())
    """The reasons why programs could not be started at all."""
    stopped: Sequence[RunningProgram] = ()
    """The programs that the check itself has ended."""

    @cached_property
    def insides(self) -> list[Inside]:
        """What each program's probe has reported, in the order of the programs."""
        if any(program.running() for program in self.programs):
            self.observer.pause(RECORDS_FOLLOW)
        return [self.inside(program) for program in self.programs]

    def inside(self, program: RunningProgram) -> Inside:
        """Return what one program's probe has reported up to now."""
        return Inside(program, self.folder, self.observer)

    def inside_of(self, node: str) -> list[Inside]:
        """Return the programs that have this node according to their probes; all programs if no probe knows it."""
        return [inside for inside in self.insides if node in inside.nodes] or self.insides

    def rules_for(self, node: str) -> Sequence[str]:
        """Return the remap rules of the program that has this node.

        If there is only one program, its rules are returned for any node.
        """
        if len(self.programs) == 1 and self.rules:
            return self.rules[0]
        for inside, rules in zip(self.insides, self.rules, strict=False):
            if node and node in inside.nodes:
                return rules
        return ()


def first(links: Iterable[Callable[[Inside], Reason | None]], insides: Sequence[Inside]) -> Reason | None:
    """Return the reason of the first link that has seen enough; None if there is none.

    All links are asked in their order about one program, then about the next.
    """
    for inside in insides:
        for link in links:
            found = link(inside)
            if found:
                return found
    return None
