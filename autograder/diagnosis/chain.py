"""The chain of links inside a running program, and the order in which they are asked.

Each link is a function whose docstring says what it must have seen. If it has not seen that, it returns None, and the
next link is asked. Earlier links explain later ones: an error in a callback ends the spinning, a blocked callback
prevents others from running, and what callbacks do matters only if they can run.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

from autograder.diagnosis import blocked, callbacks, programs
from autograder.diagnosis.scene import Scene, first
from autograder.reasons import Reason

if TYPE_CHECKING:
    from autograder.diagnosis.inside import Inside

Link = Callable[["Inside"], Reason | None]

SAID: tuple[Link, ...] = (callbacks.failed, callbacks.thread_failed)
"""The links that need only what a program reports itself. They are asked even if the probe could not see everything."""

SEEN: tuple[Link, ...] = (
    blocked.call_same_group,
    blocked.call_in_callback,
    blocked.waits_for_a_service,
    blocked.asks_nobody,
    blocked.asks_another_type,
    blocked.nested_spin,
    blocked.rate_in_callback,
    blocked.await_same_group,
    blocked.busy_wait,
    blocked.rate_unspun,
    programs.in_the_constructor,
    programs.not_added,
    programs.in_events_executor,
    programs.never_spun,
    programs.pulled_down,
    programs.thread_left,
    programs.no_longer_spun,
    blocked.takes_turn,
    blocked.stuck,
)
"""The links that conclude from everything that the probe has seen. They are asked only about a program that is running
and whose probe is attached."""


def inside_reason(scene: Scene, node: str = "") -> Reason | None:
    """Return why a running program does nothing: the first broken link inside the program of `node`, or inside any."""
    return reason_inside(scene.inside_of(node) if node else scene.insides)


def reason_inside(insides: Sequence[Inside]) -> Reason | None:
    """Return the reason of the first broken link inside one of these programs."""
    return first(SAID, insides) or first(SEEN, [inside for inside in insides if inside.alive])
