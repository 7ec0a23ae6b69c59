"""Why points were lost: the kinds of reasons that the kit knows, and a reason that was established.

A kind is declared once, in the module that gives it, and everything else is made from the declaration: the page of
reason codes, the picture in a report, and what a course says about where to read on (`[sections]` in `course.toml`).

    TOPIC_PRESENT = Kind("topic-present", "somebody uses the topic", Group.NAMES)

A reason is made by calling its kind: `TOPIC_PRESENT("`/talker` uses `/chatter`.", "Is an old program running?")`.
"""

from __future__ import annotations

import importlib
import pkgutil
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import Literal


class Group(StrEnum):
    """The headings of the page of reason codes, in its order."""

    PROGRAM = "The program"
    CALLBACKS = "Errors in callbacks"
    GOALS = "Goals of an action"
    BLOCKED = "Blocked callbacks"
    SPINNING = "Spinning"
    TOGETHER = "At the same time"
    NAMES = "Names on the graph"
    SILENCE = "QoS, lifecycle, silence"
    ENDS = "Expectations: nodes, ends, quality of service"
    MESSAGES = "Expectations: messages and callbacks"
    STATES = "Expectations: lifecycle, parameters, actions"
    OUTPUT = "Expectations: programs and their output"
    LIMITS = "Limits of the sandbox"
    FILES = "Files of answers, parameters and launches"
    BUILDING = "Packages: building them"
    BUILT = "Packages: what was built"
    RULES = "Remap and parameter rules: their form"
    EFFECT = "Remap rules: their effect"
    NOTEBOOK = "The notebook that was handed in"
    GRADER = "The grader could not find out"


KINDS: dict[str, Kind] = {}
"""The kinds that have been declared so far, by their codes."""


@dataclass(frozen=True)
class Kind:
    """A kind of reason."""

    code: str
    """A short word that stays the same when the sentences change: results, exports and statistics use it."""
    seen: str
    """What must have been seen before such a reason is given."""
    group: Group | None
    """The heading of the page of reason codes; None: the kind belongs to a lab, and is not on that page."""
    picture: Literal["", "timeline", "qos"] = ""
    """The picture that shows it: the callbacks over time, or the offered and requested QoS."""

    def __post_init__(self) -> None:
        """Register the kind.

        Raises:
            ValueError: another kind has this code.
        """
        if self.group is None:
            return
        if self.code in KINDS:
            raise ValueError(f"There are two kinds of reasons with the code {self.code!r}.")
        KINDS[self.code] = self

    def __call__(self, because: str, hint: str = "") -> Reason:
        """Return a reason of this kind."""
        return Reason(self, because, hint)


@dataclass(frozen=True)
class Reason:
    """Why something did not happen: established, or what was observed in place of a reason."""

    kind: Kind
    because: str
    """One or two sentences for the student."""
    hint: str = ""
    """What to do."""

    @property
    def code(self) -> str:
        """The kind's code."""
        return self.kind.code


class Refused(Exception):
    """What a student wrote cannot be used; the message is the reason's sentence."""

    def __init__(self, reason: Reason, place: str = "") -> None:
        """Keep the reason, and the place that its sentence begins with, if it names one."""
        super().__init__(reason.because)
        self.reason, self.place = reason, place


def kind_of_lab(code: str) -> Kind:
    """Return the kind of a reason whose code a check cell gives: one of the kit's, or one of the lab's own."""
    return KINDS.get(code) or Kind(code, "what the lab says", None)


def all_kinds() -> dict[str, Kind]:
    """Return every kind of the kit by its code; all modules of the kit are imported for it."""
    for module in pkgutil.walk_packages([str(Path(__file__).parent)], "autograder."):
        # What runs inside a student's process knows nothing of the kit.
        if not module.name.startswith("autograder.sandbox.inside"):
            importlib.import_module(module.name)
    return KINDS
