"""Options for taking in a class: the format of the submissions, and which objections a person has accepted."""

from __future__ import annotations

from enum import StrEnum


class FormatName(StrEnum):
    """The name of a format in which a class can be read; `formats` has one format for each name."""

    GRADESCOPE = "gradescope"
    EXCHANGE = "exchange"
    SUBMITTED = "submitted"
    MOODLE = "moodle"
    BLACKBOARD = "blackboard"
    CANVAS = "canvas"
    CLASSROOM50 = "classroom50"
    PLAIN = "plain"


class Accepted(StrEnum):
    """A reason to stop before anything is taken in, until a person has accepted it."""

    SMALLER = "smaller"
    """Students from the roster, or from the last run, are not among the submissions."""
    REPLACED = "replaced"
    """A submission would replace another one, and nothing says that both belong to the same student."""
    RENAMED = "renamed"
    """A student has another name than in the last run, because the roster has changed. The grades get the new name."""
    ROSTER = "roster"
    """A submission belongs to somebody who is not in the roster."""
