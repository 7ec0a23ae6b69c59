"""Build parts of sentences about a class."""

from __future__ import annotations

from collections.abc import Sequence

_NAMED = 5
"""The number of names that a sentence lists. Of the others it gives only the number."""


def count(number: int, what: str) -> str:
    """Return a number with its noun: `1 file`, `2 files`."""
    return f"{number} {what}{'s' * (number != 1)}"


def some(names: Sequence[str], between: str) -> str:
    """Join the first few names or sentences, and say how many more there are."""
    more = f"{between}and {len(names) - _NAMED} more" if len(names) > _NAMED else ""
    return between.join(names[:_NAMED]) + more
