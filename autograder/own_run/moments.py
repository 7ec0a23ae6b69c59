"""Which moments of a run a picture shows beyond doubt."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

EDGE = 0.015
"""Seconds by which things must be apart if a question is about which of them came first."""
SOME = 2
"""A number of strokes or bars that somebody can guess; questions are about as many or more."""
_COUNTABLE = 25
"""The number of strokes or bars that somebody can count in a picture."""


def countable(times: Sequence[float]) -> bool:
    """Whether somebody can count the strokes or bars of a picture at these times."""
    return len(times) <= _COUNTABLE and all(two - one >= EDGE for one, two in pairwise(times))


def apart(times: Sequence[float], *moments: float) -> bool:
    """Whether none of these times is so near to one of the moments that somebody might confuse their order."""
    return all(abs(time - moment) >= EDGE for time in times for moment in moments)
