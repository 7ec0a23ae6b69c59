"""Draws the state machine of a lifecycle node, with the transitions of one node."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from autograder.core.results import Picture
from autograder.pictures.svg import SMALL, WIDTH, Canvas

_BOX = (170.0, 50.0)
_PLACES = {
    "unconfigured": (20.0, 92.0),
    "inactive": (365.0, 92.0),
    "active": (710.0, 92.0),
    "finalized": (365.0, 246.0),
}
_PASSED = {
    "configuring": "configure",
    "activating": "activate",
    "deactivating": "deactivate",
    "cleaningup": "cleanup",
    "shuttingdown": "shutdown",
}
_EDGES = {
    ("unconfigured", "inactive"): ("configure", "M190 106H365", (277, 98)),
    ("inactive", "unconfigured"): ("cleanup", "M365 128H190", (277, 148)),
    ("inactive", "active"): ("activate", "M535 106H710", (622, 98)),
    ("active", "inactive"): ("deactivate", "M710 128H535", (622, 148)),
    ("unconfigured", "finalized"): ("shutdown", "M105 142V271H365", (170, 262)),
    ("inactive", "finalized"): ("shutdown", "M450 142V246", (506, 205)),
    ("active", "finalized"): ("shutdown", "M795 142V271H535", (730, 262)),
}
_BADGES = {
    ("unconfigured", "inactive"): (212, 106),
    ("inactive", "unconfigured"): (345, 128),
    ("inactive", "active"): (557, 106),
    ("active", "inactive"): (690, 128),
    ("unconfigured", "finalized"): (105, 190),
    ("inactive", "finalized"): (450, 170),
    ("active", "finalized"): (795, 190),
}


@dataclass(frozen=True)
class Step:
    """One requested transition and the state to which it led."""

    label: str
    start: str
    goal: str
    error: bool = False
    """Whether the callback returned ERROR or raised an exception, so that `on_error` was called."""

    @property
    def failed(self) -> bool:
        """Whether the node did not reach the goal state of the transition."""
        return self.error or (self.start == self.goal)


def steps(changes: Iterable[tuple[str, str]]) -> list[Step]:
    """Return the transitions that caused a node's state changes, which are pairs of labels as in `transition_event`."""
    found: list[Step] = []
    start, label, error = "", "", False
    for before, after in changes:
        if after in _PASSED:
            start, label, error = before, _PASSED[after], False
        elif after == "errorprocessing":
            start, label, error = (start or before), label or _PASSED.get(before, "error"), True
        elif after in _PLACES:
            found.append(Step(label, start or before, after, error))
            start, label, error = "", "", False
    return found


def lifecycle(node: str, way: Sequence[Step], state: str = "") -> Picture:
    """Draw the four primary states and the transitions between them, with numbers for the transitions of a node.

    Args:
        node: the full name of the node; if it is empty, only the state machine is drawn.
        way: the node's transitions, as returned by `steps`.
        state: the state in which the node is now; by default, the one to which its last transition led.
    """
    now = state or (way[-1].goal if way else "")
    lines = [_sentence(number, step) for number, step in enumerate(way, 1)]
    half = (len(lines) + 1) // 2 if len(lines) > 3 else len(lines)
    canvas = Canvas(322 + half * (SMALL + 8) + (10 if lines else 0), WIDTH)
    if node:
        canvas.words(20, 34, node, bold=True)
    for ends, (label, path, at) in _EDGES.items():
        taken = [number for number, step in enumerate(way, 1) if (step.start, step.goal) == ends and not step.error]
        canvas.path(path, arrow=True, line=3 if taken else 1.4)
        canvas.words(*at, label, size=SMALL, anchor="middle", halo=True)
        _numbers(canvas, taken, _BADGES[ends])
    for name, (x, y) in _PLACES.items():
        here = name == now
        canvas.box(
            x, y, *_BOX, fill="#000000" if here else "#ffffff", line=2.2 if name == "finalized" else 1.4, round=12
        )
        canvas.words(x + _BOX[0] / 2, y + 31, name, anchor="middle", bold=here, fill="#ffffff" if here else "#000000")
        back = [number for number, step in enumerate(way, 1) if step.failed and step.goal == name]
        if back:
            canvas.path(
                f"M{x + 30} {y}C{x + 10} {y - 42} {x + 90} {y - 42} {x + 70} {y}", arrow=True, line=2.4, dashed=True
            )
            canvas.words(x + 76, y - 28, "✗", bold=True)
            _numbers(canvas, back, (x + 50, y - 32))
    for number, line in enumerate(lines):
        column, row = divmod(number, half)
        canvas.words(20 + column * WIDTH / 2, 330 + row * (SMALL + 8), line, size=SMALL)
    return canvas.picture(_alt(node, lines, now))


def _numbers(canvas: Canvas, numbers: Sequence[int], at: tuple[float, float]) -> None:
    if numbers:
        canvas.badge(*at, ", ".join(map(str, numbers)) if len(numbers) < 4 else f"{numbers[0]}…", SMALL - 1)


def _sentence(number: int, step: Step) -> str:
    if step.error:
        return f"{number}  {step.label}: error, back in {step.goal}"
    if step.start == step.goal:
        return f"{number}  {step.label}: failure, still {step.goal}"
    return f"{number}  {step.label}: {step.start} → {step.goal}"


def _alt(node: str, lines: Sequence[str], now: str) -> str:
    machine = (
        "The four states of a lifecycle node: configure leads from unconfigured to inactive, activate from inactive to "
        "active, deactivate and cleanup lead back, and shutdown leads from each of these three to finalized."
    )
    if not node:
        return machine
    if not lines:
        return f"{machine} No change of {node} was heard{f'; it is {now}' if now else ''}."
    return f"{machine} The way of {node}: {'; '.join(lines)}. It is {now} now."
