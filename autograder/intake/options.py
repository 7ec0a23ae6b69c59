"""What somebody may say of a class: as what it is to be read, and what need not stop it."""

from __future__ import annotations

from enum import StrEnum


class FormatName(StrEnum):
    """As what a class is read; one for each of `formats`."""

    GRADESCOPE = "gradescope"
    EXCHANGE = "exchange"
    SUBMITTED = "submitted"
    MOODLE = "moodle"
    BLACKBOARD = "blackboard"
    CANVAS = "canvas"
    CLASSROOM = "classroom"
    PLAIN = "plain"


class Accepted(StrEnum):
    """What stops an intake until somebody has said that it is right."""

    SMALLER = "smaller"
    """Students of the roster, or of the last time, are not among the submissions."""
    REPLACED = "replaced"
    """Work would take the place of other work, and nothing says that both are of one student."""
    ROSTER = "roster"
    """Somebody is not in the roster."""
