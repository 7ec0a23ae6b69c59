"""Values that differ from run to run, so that an answer which prints a constant does not pass.

They come from a seed, which every result records.
"""

from __future__ import annotations

from typing import TypeVar

from autograder.checks import current

_T = TypeVar("_T")
_NOTED = 50
"""The number of values that a check notes."""
_LETTERS = "bcdfghjkmnpqrstvwxz"


def token(length: int = 4) -> str:
    """A random word of lower-case letters."""
    return _drawn("".join(current.check.random.choice(_LETTERS) for _ in range(length)))


def name(stem: str) -> str:
    """A ROS name that begins with `stem`: `camera_kxwf`."""
    return f"{stem}_{token()}"


def integer(low: int, high: int) -> int:
    """A whole number from `low` to `high`, both included."""
    return _drawn(current.check.random.randint(low, high))


def number(low: float, high: float) -> float:
    """A number between `low` and `high`, with two decimals."""
    return _drawn(round(current.check.random.uniform(low, high), 2))


def pick(*values: _T) -> _T:
    """One of the values."""
    return _drawn(current.check.random.choice(values))


def _drawn(value: _T) -> _T:
    """Note a value, so that a report for instructors can say which values a check drew."""
    if len(current.check.findings.varied) < _NOTED:
        current.check.findings.varied.append(str(value)[:100])
    return value
