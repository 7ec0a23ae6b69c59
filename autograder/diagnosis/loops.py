"""Callbacks that are made in a loop, and all use the loop's last value."""

from __future__ import annotations

from autograder.diagnosis.inside import Inside
from autograder.diagnosis.scene import Scene, first
from autograder.reasons import Group, Kind, Reason
from autograder.sandbox.inside.probe.events import Thing

LATE_BINDING = Kind(
    "late-binding", "callbacks of one lambda, which reads the name of the loop that it is in", Group.CALLBACKS
)


def why_all_alike(scene: Scene) -> Reason | None:
    """Why callbacks that were to differ do the same."""
    return first((late_binding,), [inside for inside in scene.insides if inside.alive])


def late_binding(inside: Inside) -> Reason | None:
    """Must have seen: several callbacks from one lambda, and in the source that this reads its loop's own name."""
    made: dict[str, list[Thing]] = {}
    for thing in inside.callbacks:
        made.setdefault(thing.line, []).append(thing)
    for line, things in made.items():
        number = int(line.rpartition(":")[2] or 0)
        name = inside.source.late_name(number) if number and len(things) > 1 else ""
        if name:
            return LATE_BINDING(
                f"`{inside.name}`, line {number} (`{inside.source.line(number)}`): the lambda reads `{name}` only "
                f"when it runs. By then the loop has ended, so all {len(things)} callbacks use the last value of "
                f"`{name}`.",
                f"Give the lambda the value when it is created: `lambda {name}={name}: ...`. Or use "
                "`functools.partial`.",
            )
    return None
