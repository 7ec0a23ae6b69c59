"""An end that the code makes in a function that has not come to it."""

from __future__ import annotations

import ast

from autograder.diagnosis.inside import Inside
from autograder.diagnosis.scene import Scene
from autograder.reasons import Group, Kind, Reason

NOT_MADE_YET = Kind(
    "not-made-yet", "a method of the source makes the end in a line where the probe has seen none made", Group.NAMES
)

_MAKERS = {
    "publisher": ("create_publisher", "create_lifecycle_publisher"),
    "subscription": ("create_subscription",),
}


def not_made_yet(scene: Scene, topic: str, kind: str, node: str) -> Reason | None:
    """Must have seen: a line in a method of the source that makes such an end, and no end made there."""
    for inside in scene.inside_of(node) if node else scene.insides:
        for method, call in _makers(inside, topic, kind) if inside.alive else []:
            code = inside.source.line(call.lineno)
            return NOT_MADE_YET(
                f"The code makes the {kind} on `{topic}` in `{method}`, line {call.lineno} (`{code}`), and the program "
                "has not come to that line.",
                "Make it in the callback after which it is to be there.",
            )
    return None


def _makers(inside: Inside, topic: str, kind: str) -> list[tuple[str, ast.Call]]:
    """The calls that would make this end and have made none, each with its method, other than `__init__`."""
    used = {int(thing.made.rpartition(":")[2] or 0) for thing in inside.things.values() if thing.kind == kind}
    found = []
    for method, call in inside.source.method_calls():
        made = isinstance(call.func, ast.Attribute) and call.func.attr in _MAKERS[kind]
        names = [word.value for word in call.args if isinstance(word, ast.Constant) and isinstance(word.value, str)]
        named = any(topic.endswith("/" + name.lstrip("~/")) for name in names)
        if made and named and used.isdisjoint(range(call.lineno, (call.end_lineno or 0) + 1)) and method != "__init__":
            found.append((method, call))
    return found
