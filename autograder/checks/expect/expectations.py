"""What every group of expectations shares: the running launch, waiting, and failing with a diagnosis."""

from __future__ import annotations

import re
import time
from collections.abc import Callable
from typing import Any, NoReturn

from autograder import diagnosis
from autograder.checks import findings, outcomes, runtime
from autograder.checks.program import Node
from autograder.checks.settling import Settling
from autograder.diagnosis import Diagnosis, Scene
from autograder.graph.observer import Observer
from autograder.sandbox.nodes import Program

WITHIN = 10.0
"""Seconds that an expectation waits at the most: far beyond what a start takes on a busy machine."""

SETTLE = 2.0
"""Seconds that a new program may take to show that it lives."""

AFTER_EXIT = 0.3
"""Seconds that evidence may still be under way after the last program has ended."""


_POINTER = re.compile(r"lecture \d", re.IGNORECASE)


def where_to_read(hint: str) -> str:
    """The parts of a check's hint that point to a lecture; the others presume what went wrong."""
    parts = [part.strip() for part in hint.split(";")]
    return " ".join(f"{part[:1].upper()}{part[1:]}" for part in parts if _POINTER.search(part))


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
        self.may_end: list[Program] = []
        """Programs that the check itself has stopped, or that are asked to end by themselves."""
        findings.current.block_began = len(findings.current.outcomes)

    def start(self, node: Node | str) -> None:
        """Start one more program."""
        raise NotImplementedError

    def scene(self) -> Scene:
        """The launch as the diagnosis sees it."""
        return Scene(
            self.observer,
            [program for _, program in self.programs],
            self._missing,
            runtime.current.folder,
            [node.all_rules() for node, _ in self.programs],
            self._trouble,
            self.stopped,
        )

    def seen_at_once(self, program: str, kind: str, name: str = "") -> int | None:
        """How many runs of a program's callbacks of one kind its probe has seen at once: evidence for reasons only.

        Args:
            program: its name.
            kind: `timer`, `subscription` or `service`: the highest number of runs of one of them.
            name: full name of its topic or service, if several are of that kind.

        Returns:
            None where the probe does not tell.
        """
        for inside in self.scene().insides:
            things = [t for t in inside.callbacks if t.kind == kind and (not name or t.name == name)]
            if inside.name == program and inside.attached and things:
                return max(thing.most for thing in things)
        return None

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

    def wait(
        self, ready: Callable[[], object], within: float = WITHIN, needs: Callable[[], object] | None = None
    ) -> bool:
        """Wait for evidence; at most `within` seconds, less when it cannot come any more.

        Args:
            ready: whether it is there.
            within: seconds.
            needs: whether that is on the graph without which it cannot come; on a graph that has settled without it,
                the verdict is decided.
        """
        return self.observer.wait(ready, within, self.hopeless(needs) if needs else self.all_ended)

    def hopeless(self, needs: Callable[[], object]) -> Callable[[], bool]:
        """Return a question to ask while waiting: whether what needs this on the graph cannot come any more."""
        settling = Settling(self.observer, [program for _, program in self.programs])
        return lambda: self.all_ended() or (not needs() and settling.decided())

    def without_node(self, node: str) -> Callable[[], bool]:
        """Return the question whether a node that is waited for cannot come any more."""
        return self.hopeless(lambda: node in self.observer.nodes())

    def wait_for_graph(self, ready: Callable[[], object], within: float = WITHIN) -> bool:
        """Wait for something on the graph; at most `within` seconds, less when the graph has settled without it."""
        return self.wait(ready, within, needs=ready)

    def gone_program(self) -> Program | None:
        """A program that has ended by itself, though it had to go on: it failed, or it ended as the last one."""
        ended = [program for _, program in self.programs if not program.running() and program not in self.may_end]
        failed = [program for program in ended if program.exit_status() != 0]
        last = ended if len(ended) == len(self.programs) else []
        return next(iter(failed + last), None)

    def settle_programs(self) -> None:
        """Give a new program a moment to show what becomes of it, before something is held against it."""
        youngest = max((program.began for _, program in self.programs), default=0.0)
        self.observer.wait(self.gone_program, youngest + SETTLE - time.monotonic())

    def fail(
        self, title: str, reason: Diagnosis | None, *, expected: str = "", observed: str = "", hint: str = ""
    ) -> NoReturn:
        """Record a failure with the first broken link as its reason, and end the block.

        Where a program has ended that had to go on, or is bound to, the whole launch has failed: how much of it was
        seen before is a matter of luck, and a verdict must not depend on that.
        """
        self.settle_programs()
        gone = self.gone_program() or diagnosis.failed_in_a_callback(self.scene())
        if gone is not None:
            scene = self.scene()
            # An error in a callback is the reason whether or not it has ended the program by now.
            trouble = diagnosis.program_trouble(scene) or diagnosis.inside_reason(scene)
            reason = trouble if trouble and trouble.code != "exited" else reason or trouble
        because = reason.because if reason else ""
        code = reason.code if reason else ""
        hint = reason.hint + " " * bool(reason.hint) + where_to_read(hint) if reason and reason.hint else hint
        if gone is None:
            outcomes.failed(title, expected=expected, observed=observed, because=because, hint=hint, code=code)
        outcomes.failed_as_a_whole(
            f"`{gone.name}` runs until it is stopped",
            expected="running",
            observed=gone.stopped_by()
            or ("an error in a callback" if gone.running() else f"ended with status {gone.exit_status()}"),
            because=because,
            hint=hint,
            code=code,
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
            self.settle_programs()
            self.fail(title, diagnose(), expected=expected, observed=text, hint=hint)
