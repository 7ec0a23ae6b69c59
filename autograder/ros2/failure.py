"""Exceptions that end a verb if it cannot do what was requested."""

from __future__ import annotations


class Failure(Exception):
    """A mistake of the user, or something that does not exist. The message is a sentence of the real tool.

    The exit status is 1 then.
    """


class TimeIsUp(Exception):
    """The verb would continue, but its time limit is over."""
