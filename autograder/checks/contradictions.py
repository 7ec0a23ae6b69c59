"""Finds evidence that a student may have faked: what the probe saw inside a program contradicts what the graph showed.

No points are taken; an instructor is shown both sides. A flag is raised only if no ordinary program can cause the
contradiction. Nothing is flagged if the probe could not see everything, or if a callback used `await`.
"""

from __future__ import annotations

from collections.abc import Sequence
from hashlib import sha256

from autograder.diagnosis import Scene
from autograder.diagnosis.inside import Inside
from autograder.sandbox.inside.probe.events import Thing

ENOUGH = 4
"""Messages of a publisher from which on its threads say something: two begins and two ends."""

_names_in_code: dict[tuple[str, str], tuple[tuple[str, ...], frozenset[str]]] = {}
"""(Program, digest of its source) -> the rules of its first launch here, and the names that its code gave then."""


def flags(scene: Scene, overlaps: Sequence[tuple[str, str]], varied: Sequence[bool]) -> list[str]:
    """What contradicts itself in a launch that is about to end.

    Args:
        scene: the launch.
        overlaps: topic and title of each expectation of overlapping callbacks that was met.
        varied: of each program, whether it was given parameters or arguments, which may rightly decide about names.
    """
    insides = [scene.inside(program) for program in scene.programs]
    by_hand = [overlap_by_hand(insides, topic, title) for topic, title in overlaps]
    return [flag for flag in by_hand if flag] + names_by_hand(scene, insides, varied)


def overlap_by_hand(insides: Sequence[Inside], topic: str, title: str) -> str:
    """Flag overlapping begins and ends that all came from one thread, if no callback of the program used `await`."""
    seen = [(inside, thing) for inside in insides for thing in _publishers(inside, topic)]
    if not seen or not all(inside.alive for inside, _ in seen):
        return ""
    if sum(thing.threads for _, thing in seen) != 1 or sum(thing.runs for _, thing in seen) < ENOUGH:
        return ""
    inside, thing = next((inside, thing) for inside, thing in seen if thing.threads)
    if any(other.awaited for other in inside.things.values()):
        return ""
    most = max((executor.most for executor in inside.executors), default=0)
    together = f"at most {most}" if most > 1 else "no two"
    return (
        f"{title}: the messages on `{topic}` say so. But inside `{inside.name}` one thread published all "
        f"{thing.runs} of them, and {together} callbacks were seen to run at once."
    )


def _publishers(inside: Inside, topic: str) -> list[Thing]:
    return [thing for thing in inside.things.values() if thing.kind == "publisher" and thing.name == topic]


def names_by_hand(scene: Scene, insides: Sequence[Inside], varied: Sequence[bool]) -> list[str]:
    """Flag programs whose code names its topics differently than in an earlier launch with other remap rules."""
    found = []
    for inside, rules, free in zip(insides, scene.rules, varied, strict=False):
        names = frozenset(
            thing.given for thing in inside.things.values() if thing.kind in ("publisher", "subscription")
        )
        if free or not inside.attached or not names:
            continue
        try:
            source = sha256((scene.folder / f"{inside.name}.py").read_bytes()).hexdigest()
        except OSError:
            continue
        before, had = _names_in_code.setdefault((inside.name, source), (tuple(rules), names))
        if before != tuple(rules) and not (names <= had or had <= names):
            found.append(
                f"`{inside.name}`: its code names its topics {_listed(names)} when it is started with "
                f"{_listed(rules) or 'no rules'}, and {_listed(had)} with {_listed(before) or 'no rules'}. Remap rules "
                "do not change the names in the code."
            )
    return found


def _listed(names: Sequence[str] | frozenset[str]) -> str:
    return ", ".join(f"`{name}`" for name in (names if isinstance(names, (list, tuple)) else sorted(names)))
