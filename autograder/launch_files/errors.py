"""What goes wrong with a launch file, and how large such a file and what comes of it may be."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from autograder.reasons import Group, Kind, Refused

LAUNCH_FILE = Kind("launch-file", "the launch file cannot be run; the sentence names the line", Group.FILES)

INCLUDE_DEPTH = 8
"""Launch files that may include one another, one inside the next."""
MOST_NODES = 32
"""Nodes that one launch may start: more participants than that do not find each other on one machine."""
MOST_ACTIONS = 1000
"""Actions that one launch may run, those of included files counted each time."""
TEXT_LENGTH = 8000
"""Characters of a text after its substitutions: a few lines that double a text would fill the memory."""
SUBSTITUTION_DEPTH = 10
"""Substitutions that may stand inside one another."""


def refused(because: str, hint: str = "") -> Refused:
    """The error to raise for something in a value whose place is not known yet."""
    return Refused(LAUNCH_FILE(because, hint))


@dataclass(frozen=True)
class Place:
    """Where in which file something stands, to be named in an error."""

    file: str
    folder: Path
    where: str = ""
    written: str = ""
    """The text that stands there, if it is one value, before YAML makes a number or a truth value of it."""

    def at(self, more: str, written: str = "") -> Place:
        """A place further inside."""
        return Place(self.file, self.folder, f"{self.where} > {more}" if self.where else more, written)

    def error(self, because: str, hint: str = "") -> Refused:
        """The error to raise for this place."""
        place = f"{self.file}, {self.where}" if self.where else self.file
        return Refused(LAUNCH_FILE(f"{place}: {because}", hint), place)
