"""Why points were lost: the kinds of reasons that the kit knows, and the reasons given for one submission.

A kind is declared once, in the module that gives reasons of this kind. Everything else is derived from the
declaration: the page of reason codes, the picture in a report, and where a course tells students to read on
(`[sections]` in `course.toml`).

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
    """The headings of the page of reason codes, in the order of the page."""

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
    WORLD = "Expectations: the car in its world"
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
    """A short identifier that stays the same when the sentences change. Results, exports and statistics use it."""
    seen: str
    """What must have been observed before a reason of this kind is given."""
    group: Group | None
    """The heading on the page of reason codes. It is None for a kind that belongs to a lab and is not on that page."""
    picture: Literal["", "timeline", "qos"] = ""
    """The picture that illustrates it: the callbacks over time, or the offered and requested QoS."""

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
    """The established reason why something did not happen, or, if none was established, what was observed instead."""

    kind: Kind
    because: str
    """One or two sentences for the student."""
    hint: str = ""
    """What the student can do."""

    @property
    def code(self) -> str:
        """The kind's code."""
        return self.kind.code


class Refused(Exception):
    """Raised if something that a student wrote cannot be used; the message is the sentence of the reason."""

    def __init__(self, reason: Reason, place: str = "") -> None:
        """Keep the reason, and the place in the file with which its sentence begins, if there is one."""
        super().__init__(reason.because)
        self.reason, self.place = reason, place


def kind_of_lab(code: str) -> Kind:
    """Return the kind with a code that a check cell gives: either a kind of the kit or one of the lab's own."""
    return KINDS.get(code) or Kind(code, "what the lab says", None)


def all_kinds() -> dict[str, Kind]:
    """Return every kind of the kit by its code. This imports all modules of the kit."""
    for module in pkgutil.walk_packages([str(Path(__file__).parent)], "autograder."):
        # The modules that run inside a student's process declare no kinds and do not use the kit.
        if not module.name.startswith("autograder.sandbox.inside"):
            importlib.import_module(module.name)
    return KINDS
