"""The chain inside a living program: which links there are, and in which order they are asked.

Each link is a function that says in its docstring what it must have seen; it gives None where it has not seen that,
and the next one is asked. What comes first explains what comes after it: an error in a callback ends the spinning, a
blocked callback keeps others from running, and only where callbacks can run does it matter what they do.
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
"""What a program says by itself; true whatever else the probe could see."""

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
    programs.never_spun,
    programs.pulled_down,
    programs.thread_left,
    programs.no_longer_spun,
    blocked.takes_turn,
    blocked.stuck,
)
"""What is concluded from all that the probe has seen; nothing where it could not see all."""


def inside_reason(scene: Scene, node: str = "") -> Reason | None:
    """Why a program that lives does nothing: the first broken link inside the program of `node`, or inside any."""
    return reason_inside(scene.inside_of(node) if node else scene.insides)


def reason_inside(insides: Sequence[Inside]) -> Reason | None:
    """The first broken link inside one of these programs."""
    return first(SAID, insides) or first(SEEN, [inside for inside in insides if inside.alive])
