"""How a student goes on after a finding: hints one at a time, and the section of a lecture that explains the reason."""

from __future__ import annotations

import re
from dataclasses import dataclass

from autograder.core.results import Outcome

LECTURES = {
    1: "01_nodes",
    2: "02_executors",
    3: "03_remapping",
    4: "04_lifecycle",
    5: "05_qos",
    6: "06_actions",
    7: "07_interfaces",
    8: "08_bringup",
}
"""The pages of the book, without their ending."""

SECTIONS: dict[tuple[int, str], str] = {
    (2, "What `spin` does"): "not-spinning node-not-added spinning-ended stuck-in-init",
    (2, "First repair: more threads?"): "single-threaded-executor",
    (2, "Second repair: a callback group"): "no-callback-groups one-group exclusive-group",
    (2, "Groups by design"): "no-overlap overlap paused group-limit",
    (2, "How many threads?"): "few-threads machine-threads too-few-runs",
    (2, "A group that has too much to do"): "starved timer-same-group",
    (2, "What callbacks share"): "waits-for-lock lost-update",
    (2, "A service inside a callback"): (
        "call-same-group call-in-callback await-same-group nested-spin busy-wait rate-in-callback waits-for-service"
    ),
    (2, "When a program is silent"): (
        "callback-exception service-exception thread-exception stuck-callback thread-left rate-unspun silent no-answer "
        "never-awaited late-binding"
    ),
    (3, "Relative, private, absolute"): "topic-name no-topic absolute-name wrong-end topic-present",
    (3, "A service has a name, too"): "service-name no-service",
    (3, "Remap rules"): (
        "node-name namespace rule-order rules-do-not-chain rule-prefix rule-kind absolute-rule private-rule"
        " rule-without-match rule-takes-name parameter-as-rule"
    ),
    (3, "What ROS 2 refuses"): (
        "name-space name-slash name-characters begins-with-digit double-underscore wildcard command-line"
    ),
    (3, "Several nodes in one process"): "one-name-for-all duplicate-node",
    (
        3,
        "Parameters",
    ): "parameter-undeclared parameter-not-declared parameter-value parameter-type parameter-for-others",
    (3, "While the node runs"): "parameter-accepted parameter-refusal",
    (3, "Parameter files"): "params-file params-file-key params-file-missing",
    (3, "Launch files"): "launch-file launch-argument argument-not-needed",
    (4, "Four states"): "state transitions not-lifecycle",
    (4, "The one thing that is managed"): "lifecycle-inactive no-super-on-activate",
    (4, "When a transition goes wrong"): (
        "transition-failed transition-succeeded lifecycle-exception lifecycle-return"
    ),
    (5, "Offered and requested"): "qos-reliability qos-durability",
    (5, "Deadline"): "qos-deadline",
    (5, "Liveliness"): "qos-liveliness qos-lease",
    (5, "Lifespan"): "qos-lifespan lifespan",
    (6, "A server"): "execute-return no-succeed goal-return no-feedback",
    (6, "A second thread"): "goal-holds-thread goal-holds-group",
    (6, "How a goal ends"): "execute-exception cancel-return no-cancel-callback",
    (6, "Look into an action"): "no-action action-name",
    (7, "What makes a folder a package"): (
        "package-xml package-name package-file package-depend setup-py not-installed"
    ),
    (7, "A forgotten line"): "build-type executable-place entry-point entry-point-target",
    (7, "A type of one's own"): "interface-line interface-parts interface-type interface-fields",
    (7, "Interfaces are built"): (
        "interface-file interface-dependency interface-group no-interface cmake cmake-package"
    ),
    (7, "Using it"): "answer brake",
}
"""The section of a lecture, and the codes of the reasons that it explains. A test holds the sections and the codes."""

_POINTER = re.compile(r"\blecture (\d), (?:section )?'([^']+)'", re.IGNORECASE)
_PIECE = re.compile(r";\s+|(?<=[.?!])\s+(?=[A-Z`])")


@dataclass(frozen=True)
class Section:
    """A section of a lecture."""

    lecture: int
    title: str

    def __str__(self) -> str:
        """As a hint names it."""
        return f"Lecture {self.lecture}, section '{self.title}'"

    @property
    def place(self) -> str:
        """Its place in the book, as a link from the book's first page."""
        slug = re.sub(r"[^a-z0-9]+", "-", self.title.lower()).strip("-")
        return f"{LECTURES[self.lecture]}.html#{slug}"


@dataclass(frozen=True)
class Hint:
    """One hint; the next one tells more."""

    text: str
    section: Section | None = None
    """Where to read on."""


def section_for(code: str) -> Section | None:
    """Return the section that explains a reason; None if there is none."""
    return next((Section(*where) for where, codes in SECTIONS.items() if code and code in codes.split()), None)


def hints(outcome: Outcome) -> list[Hint]:
    """Return an outcome's hints, the one that tells least first: where to read on, then what to look at or to do."""
    pieces = [piece.strip() for piece in _PIECE.split(outcome.hint) if piece.strip()]
    pointing = [(piece, _POINTER.search(piece)) for piece in pieces]
    read = [Hint(_sentence(text), Section(int(m[1]), m[2])) for text, m in pointing if m and int(m[1]) in LECTURES]
    section = section_for(outcome.code)
    if not read and section is not None:
        read = [Hint(f"{section}.", section)]
    named = {hint.text for hint in read}
    return [*read, *(Hint(text) for text in map(_sentence, pieces) if text not in named)]


def _sentence(text: str) -> str:
    text = text[:1].upper() + text[1:]
    return text if text.endswith((".", "?", "!", ":", "…", "`")) else f"{text}."
