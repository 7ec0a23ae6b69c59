"""How often messages come, by their publisher's own stamps: a slow grader makes no difference."""

from __future__ import annotations

import itertools
import statistics
from collections.abc import Sequence

from autograder.graph.recording import Received


def median_gap(received: Sequence[Received]) -> float:
    """Seconds between two messages as they were published; 0 if there are fewer than two."""
    gaps = [later.stamp - earlier.stamp for earlier, later in itertools.pairwise(received)]
    return statistics.median(gaps) if gaps else 0.0


def at_rate(received: Sequence[Received], rate: float, tolerance: float) -> bool:
    """Whether messages come at this rate.

    Args:
        received: at least two messages.
        rate: hertz.
        tolerance: allowed deviation of the period, as a share.
    """
    median = median_gap(received)
    return median > 0 and abs(median - 1 / rate) <= tolerance / rate


def in_words(received: Sequence[Received]) -> str:
    """The rate at which messages came."""
    median = median_gap(received)
    return f"{1 / median:.1f} Hz" if median > 0 else "all at once"
