"""How a verb ends that cannot do what it was asked to."""

from __future__ import annotations


class Failure(Exception):
    """The user's mistake, or something that is not there: one sentence, in the real tool's words; exit status 1."""


class TimeIsUp(Exception):
    """The verb would go on, and was given only so many seconds."""
