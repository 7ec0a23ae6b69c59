"""What the names in a class say: whose each entry is."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from autograder.intake.entries import Entry


@dataclass(frozen=True)
class Claim:
    """An entry that is somebody's."""

    entry: Entry
    owner: Mapping[str, str]
    """What the platform calls the student, by kind: `name`, `email`, `id`, `canvas_id`, `moodle_id`, `github`."""
    called: str = ""
    """A file's name as the student gave it, without what the platform put before it."""
    attempt: tuple[Any, ...] = ()
    """Of two attempts of one student, the greater one is the later."""
    number: int = 0
    """The same for the files of one attempt, where the platform counts them."""
    turn: tuple[Any, ...] = ()
    """Of the files of one attempt, the one with the greatest counts."""
    handed_in: str = ""
    """Date and time, as nbgrader reads them; empty if nothing says so."""
    late: bool = False
    """The platform has marked it as late."""
    by_hand: bool = False
    """Its name is not of the platform's form: somebody has added it."""
    only: str = ""
    """The folder in the entry in which the work for this lab lies; empty: anywhere."""


@dataclass
class Recognised:
    """What a format makes of the entries of a class."""

    claims: list[Claim] = field(default_factory=list)
    strange: list[str] = field(default_factory=list)
    """Sentences about what was recognised and is nobody's."""
    aside: list[Entry] = field(default_factory=list)
    """What is of another lab, or tells whose the others are: it is not used, and needs not be."""
