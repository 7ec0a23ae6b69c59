"""What every group of expectations shares: the running launch, waiting, and failing with a diagnosis."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, Any, NoReturn

from autograder import diagnosis
from autograder.checks import outcomes, picture_data, scoring
from autograder.checks.misuse import Misuse
from autograder.checks.running_launch import RunningLaunch
from autograder.core.results import Picture
from autograder.diagnosis import Scene
from autograder.diagnosis.inside import Inside
from autograder.diagnosis.programs import EXITED, NOT_SPINNING, SPINNING_ENDED
from autograder.graph.observer import Observer
from autograder.reasons import Group, Kind, Reason, kind_of_lab

if TYPE_CHECKING:
    from autograder.graph.actions import Goal  # loads numpy, which most labs do not need

WITHIN = 10.0
"""Seconds that an expectation waits at the most: far beyond what a start takes on a busy machine."""

GONE_WITHIN = 2.0
"""Seconds that an absence may take to show, for example after a node was stopped."""

REQUIRED = Kind(
    "required", "a fact that the check established does not hold; the check gave no code of its own", Group.OUTPUT
)

_POINTER = re.compile(r"\w, (?:sections? )?'[^']+'")
"""`Week 2, section 'Groups'`, whatever a course calls its parts."""


def where_to_read(hint: str) -> str:
    """Return the parts of a check's hint that say where to read on, because the others assume a certain mistake."""
    parts = [part.strip() for part in hint.split(";")]
    return " ".join(f"{part[:1].upper()}{part[1:]}" for part in parts if _POINTER.search(part))


def objection(verdict: object, otherwise: str) -> str:
    """Return what a check's own function objects to; empty if it objects to nothing.

    Args:
        verdict: its answer: a sentence that says what is wrong, or whether all is well.
        otherwise: what is said where it only says that something is wrong.
    """
    if isinstance(verdict, str):
        return verdict or otherwise
    return "" if verdict else otherwise


class Expectations:
    """A running launch. Each noun adds its own expectations."""

    def __init__(self, running: RunningLaunch) -> None:
        """Ask about this launch."""
        self._running = running

    @property
    def _observer(self) -> Observer:
        return self._running.observer

    def _scene(self) -> Scene:
        return self._running.scene()

    def _insides(self) -> list[Inside]:
        """The programs as their probes show them at this moment."""
        scene = self._scene()
        return [scene.inside(program) for program in scene.programs]

    def _without(self, node: str) -> Callable[[], bool]:
        """Return a function that tells whether a node that is waited for cannot appear any more."""
        return self._running.hopeless_without(lambda: node in self._observer.nodes())

    def _wait(
        self, ready: Callable[[], object], within: float = WITHIN, needs: Callable[[], object] | None = None
    ) -> bool:
        """Wait until something is so, and tell whether it is: this records no outcome.

        Args:
            ready: what is waited for; anything true will do. It is asked again and again.
            within: seconds until it must have come. The wait ends earlier when every program has ended.
            needs: whether that is on the graph without which it cannot come. Once nothing new appears on the graph
                and it is still missing, the wait ends.
        """
        give_up = self._running.hopeless_without(needs) if needs else self._running.all_ended
        return self._observer.wait(ready, within, give_up)

    def _wait_for_graph(self, ready: Callable[[], object], within: float = WITHIN) -> bool:
        """Wait for something on the graph; the wait ends earlier once nothing new appears there."""
        return self._wait(ready, within, needs=ready)

    def _topics(self) -> str:
        own = [t for t in sorted(self._observer.topics()) if t not in ("/rosout", "/parameter_events")]
        return ", ".join(own) or "no topic"

    def _sure_if(self, sure: bool) -> None:
        """Note that the next decision would be the same on any machine, so that the check is not run again for it.

        A busy machine makes a program slower, but never faster, and it does not change what a message says.
        """
        if sure:
            self._observer.patience.is_sure()

    def _fail(
        self,
        title: str,
        reason: Reason | None,
        *,
        expected: str = "",
        observed: str = "",
        hint: str = "",
        picture: Picture | None = None,
    ) -> NoReturn:
        """Record a failure with the first broken link as its reason, and end the block.

        Where a program has ended that had to go on, or is bound to, the whole launch has failed, but for the parts
        before that with which the check itself brought it about; see `autograder.checks.scoring`.
        """
        self._running.settle_programs()
        gone = self._running.gone_program() or diagnosis.failed_in_a_callback(self._scene())
        if gone in self._running.may_end:
            gone = None
        if gone is not None:
            scene = self._scene()
            # An error in a callback is the reason whether or not it has ended the program by now.
            trouble = diagnosis.program_trouble(scene) or diagnosis.inside_reason(scene)
            reason = trouble if trouble and trouble.kind is not EXITED else reason or trouble
        reason = reason or outcomes.FAILED("")
        reason = replace(reason, hint=f"{reason.hint} {where_to_read(hint)}" if reason.hint else hint)
        if gone is None:
            picture = picture or picture_data.explaining(reason, title, self._observer, self._insides())
            outcomes.failed(title, reason, expected=expected, observed=observed, picture=picture)
        led_to = diagnosis.called_from_outside(gone)
        outcomes.failed_as_a_whole(
            f"`{gone.name}` runs until it is stopped",
            reason,
            expected="running",
            observed=gone.stopped_by()
            or ("an error in a callback" if gone.running() else f"ended with status {gone.exit_status()}"),
            standing=scoring.before(*led_to) if led_to else (),
        )

    def _expect_that(
        self,
        holds: object,
        title: str,
        diagnose: Callable[[], Reason | None] = lambda: None,
        *,
        expected: str = "",
        observed: Any = "",
        hint: str = "",
    ) -> None:
        """Record an outcome for an established fact. A reason is looked for only if the fact does not hold."""
        text = str(observed() if callable(observed) else observed)
        if holds:
            outcomes.passed(title, expected=expected, observed=text)
        else:
            self._running.settle_programs()
            self._fail(title, diagnose(), expected=expected, observed=text, hint=hint)

    def _why_not(
        self, because: str, *, code: str = "", evident: object = False, node: str = "", goal: Goal | None = None
    ) -> Reason | None:
        """Why a fact does not hold that the check has established; `ros.require` says what the arguments mean."""
        scene = self._scene()
        found = (
            diagnosis.program_trouble(scene),
            diagnosis.why_no_result(scene, goal.name) if goal is not None and goal.empty_handed else None,
            None if evident else diagnosis.inside_reason(scene, node),
        )
        # Where the check has a reason, these say less: they are what a program looks like that does nothing more.
        vague = (EXITED, NOT_SPINNING, SPINNING_ENDED) if because else ()
        trouble = next((one for one in found if one and one.kind not in vague), None)
        kind = kind_of_lab(code) if code else REQUIRED
        return trouble or (kind(because) if because else None)


class Noun(Expectations):
    """One thing of a launch that has a name, such as a topic, and what can be asked of it."""

    _full_name = True
    """Whether its name has a namespace, as those of nodes and topics do."""

    def __init__(self, running: RunningLaunch, name: str) -> None:
        """Ask about what has this name in this launch.

        Raises:
            Misuse: it is no name, or no full one.
        """
        if not isinstance(name, str) or (self._full_name and not name.startswith("/")):
            raise Misuse(f"{name!r} is no full name; write it with its namespace, as in '/front/camera'.")
        super().__init__(running)
        self.name = name

    def __repr__(self) -> str:
        return f"{type(self).__name__.lower()} {self.name}"
