"""What a format says of the files that it recognises: whose notebook each is."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from autograder.intake.members import Member


@dataclass(frozen=True)
class Claim:
    """A notebook that somebody handed in."""

    member: Member
    owner: Mapping[str, str]
    """What the platform calls the student, by kind: `name`, `email`, `id`, `canvas_id`, `moodle_id`, `github`."""
    called: str = ""
    """The file's name as the student gave it, without what the platform put before it."""
    attempt: tuple[Any, ...] = ()
    """Of two attempts of one student, the greater one is the later."""
    turn: tuple[Any, ...] = ()
    """The same for the files of one attempt."""
    handed_in: str = ""
    """Date and time, as nbgrader reads them; empty if nothing says so."""
    late: bool = False
    """The platform has marked it as late."""
    secret: str = ""
    """By what nbgrader's exchange knows the feedback on it; empty if it did not come from there."""


@dataclass
class Recognised:
    """What a format makes of the files."""

    format: str
    claims: list[Claim] = field(default_factory=list)
    strange: list[str] = field(default_factory=list)
    """Sentences about what was recognised and holds no notebook."""


def nothing_from(everybody: Mapping[str, str], with_notebook: set[str]) -> list[str]:
    """Sentences about who handed in no notebook."""
    return [f"{who[:100]} handed in no notebook." for key, who in everybody.items() if key not in with_notebook]
