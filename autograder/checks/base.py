"""What every group of expectations shares: the running launch, waiting, and failing with a diagnosis."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, NoReturn

from autograder.checks import outcomes
from autograder.graph.observer import Observer
from autograder.sandbox.nodes import Program

if TYPE_CHECKING:
    from autograder.checks.launch import Node
    from autograder.graph.diagnosis import Diagnosis

WITHIN = 10.0
"""Seconds that an expectation waits at the most: far beyond what a start takes on a busy machine."""

AFTER_EXIT = 0.3
"""Seconds that evidence may still be under way after the last program has ended."""


class ExpectationBase:
    """The state that the groups of expectations work on."""

    observer: Observer
    nodes: list[Node]
    programs: list[tuple[Node, Program]]
    domain_id: int
    _missing: list[str]
    _trouble: list[Diagnosis]

    def prepare(self) -> None:
        """Set up what each group needs for this launch."""
        self._ended: float | None = None
        self.stopped: list[Program] = []
        """Programs that the check itself has stopped."""

    def start(self, node: Node | str) -> None:
        """Start one more program."""
        raise NotImplementedError

    def served(self, name: str) -> list[tuple[float, float]]:
        """When requests to an offered service arrived and were answered, seconds on the system clock."""
        raise NotImplementedError

    def all_ended(self) -> bool:
        """Whether nothing can come any more: every program has ended (or none could be started), a moment ago."""
        if any(program.running() for _, program in self.programs):
            self._ended = None
            return False
        if self._ended is None:
            self._ended = time.monotonic()
        return time.monotonic() - self._ended > AFTER_EXIT

    def wait(self, ready: Callable[[], object], within: float = WITHIN) -> bool:
        """Wait for evidence; at most `within` seconds, less when every program has ended."""
        return self.observer.wait(ready, within, self.all_ended)

    def fail(
        self, title: str, diagnosis: Diagnosis | None, *, expected: str = "", observed: str = "", hint: str = ""
    ) -> NoReturn:
        """Record a failure with the first broken link as its reason, and end the block."""
        outcomes.failed(
            title,
            expected=expected,
            observed=observed,
            because=diagnosis.because if diagnosis else "",
            hint=" ".join(part for part in (diagnosis.hint if diagnosis else "", hint) if part),
            code=diagnosis.code if diagnosis else "",
        )

    def expect_that(
        self,
        holds: object,
        title: str,
        diagnose: Callable[[], Diagnosis | None] = lambda: None,
        *,
        expected: str = "",
        observed: Any = "",
        hint: str = "",
    ) -> None:
        """Record an outcome for a fact that has been established."""
        text = str(observed() if callable(observed) else observed)
        if holds:
            outcomes.passed(title, expected=expected, observed=text)
        else:
            self.fail(title, diagnose(), expected=expected, observed=text, hint=hint)
