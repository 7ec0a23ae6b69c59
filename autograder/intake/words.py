"""Parts of sentences about a class."""

from __future__ import annotations

from collections.abc import Sequence

_NAMED = 5
"""Of more names than this only their number is said."""


def count(number: int, what: str) -> str:
    """Return a number of things: `1 file`, `2 files`."""
    return f"{number} {what}{'s' * (number != 1)}"


def some(names: Sequence[str], between: str) -> str:
    """Return the first of several names or sentences, and how many more there are."""
    more = f"{between}and {len(names) - _NAMED} more" if len(names) > _NAMED else ""
    return between.join(names[:_NAMED]) + more
