"""Errors in launch files, and the limits for such files and for what they start."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from autograder.reasons import Group, Kind, Refused

LAUNCH_FILE = Kind("launch-file", "the launch file cannot be run; the sentence names the line", Group.FILES)

INCLUDE_DEPTH = 8
"""The largest number of launch files that may be nested by includes."""
MOST_NODES = 32
"""The number of nodes that one launch may start. More participants do not discover each other on one machine."""
MOST_ACTIONS = 1000
"""The number of actions that one launch may run. Those of an included file count each time that it is included."""
TEXT_LENGTH = 8000
"""The characters of a text after its substitutions. Without this limit, a few lines that double a text would fill the
memory."""
SUBSTITUTION_DEPTH = 10
"""The largest number of substitutions that may be nested."""


def refused(because: str, hint: str = "") -> Refused:
    """Return the error to raise for a fault in a value whose place is not known yet."""
    return Refused(LAUNCH_FILE(because, hint))


@dataclass(frozen=True)
class Place:
    """A place in a file, which is named in an error."""

    file: str
    folder: Path
    where: str = ""
    written: str = ""
    """If there is a single value in this place: its text, before YAML converts it to a number or a truth value."""

    def at(self, more: str, written: str = "") -> Place:
        """Return a place inside this one."""
        return Place(self.file, self.folder, f"{self.where} > {more}" if self.where else more, written)

    def error(self, because: str, hint: str = "") -> Refused:
        """Return the error to raise for this place."""
        place = f"{self.file}, {self.where}" if self.where else self.file
        return Refused(LAUNCH_FILE(f"{place}: {because}", hint), place)
