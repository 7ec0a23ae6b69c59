"""How often messages come, by their publisher's own stamps: a slow grader makes no difference."""

from __future__ import annotations

import itertools
import statistics
from collections.abc import Sequence

from autograder.graph.recording import Received
from autograder.reasons import Group, Kind

RATE = Kind("rate", "the median time between messages does not fit the required rate", Group.MESSAGES)

_SHORT = 0.5
"""The share of a period below which a gap is short: a timer that was held up makes one, two timers make many."""

_IN_A_ROW = 4
"""How many gaps in a row have to be of the right length together, where there are few of them."""

_MANY = 7
"""From so many gaps on, a slower timer would have to be held up again and again for just as long."""


def _gaps(received: Sequence[Received], every: bool) -> list[float]:
    """Seconds from one message to the next as they were published.

    Where these are to be `every` message of the topic, what was lost on the way, which the publisher's count tells, is
    no pause of the publisher's.
    """
    pairs = list(itertools.pairwise(received))
    return [(b.stamp - a.stamp) / (max(1, b.sequence - a.sequence) if every else 1) for a, b in pairs]


def median_gap(received: Sequence[Received], every: bool = True) -> float:
    """Seconds between two messages as they were published; 0 if there are fewer than two."""
    return statistics.median(_gaps(received, every) or [0.0])


def at_rate(received: Sequence[Received], rate: float, tolerance: float, every: bool = True) -> bool:
    """Whether messages come at this rate.

    Args:
        received: at least two messages.
        rate: hertz.
        tolerance: allowed deviation of the period, as a share.
        every: whether these are all messages of their topic, but for what was lost on the way.
    """
    gaps = _gaps(received, every)
    near = bool(gaps) and abs(statistics.median(gaps) - 1 / rate) <= tolerance / rate
    return near and not _in_bursts(gaps, 1 / rate)


def _in_bursts(gaps: Sequence[float], period: float) -> bool:
    return sum(gap < _SHORT * period for gap in gaps) > len(gaps) // 3


def in_time(received: Sequence[Received], rate: float, tolerance: float, every: bool = True) -> bool:
    """Whether messages are so many that the median tells their rate, or a timer of this rate was in time for a while.

    A timer that is held up less and less long makes short gaps, but it keeps its beat: from the first to the last of n
    calls at least n - 2 of its periods go by (rcl, `rcl_timer_call`). A slower one is never in time for four periods.
    The arguments are those of `at_rate`.
    """
    gaps = _gaps(received, every)
    return len(gaps) >= _MANY or _quickest(gaps) <= (1 + tolerance) / rate


def _quickest(gaps: Sequence[float]) -> float:
    """Return the shortest mean gap of any run of consecutive gaps that are looked at together."""
    length = min(_IN_A_ROW, len(gaps))
    return min((statistics.fmean(gaps[i : i + length]) for i in range(len(gaps) - length + 1)), default=0.0)


def too_slow(received: Sequence[Received], rate: float, every: bool = True) -> bool:
    """Whether messages come less often than at this rate, which a busy machine can also do to the right rate."""
    gaps = _gaps(received, every)
    return not gaps or statistics.median(gaps) > 1 / rate or (len(gaps) < _MANY and _quickest(gaps) > 1 / rate)


def in_words(received: Sequence[Received], every: bool = True) -> str:
    """The rate at which messages came."""
    gaps = _gaps(received, every)
    if not gaps or sum(gaps) <= 0 or statistics.median(gaps) <= 0:
        return "all at once"
    return f"{len(gaps) / sum(gaps) if together(received, every) else 1 / statistics.median(gaps):.1f} Hz"


def together(received: Sequence[Received], every: bool = True) -> bool:
    """Whether several messages came close together, so that a median says nothing about their rate."""
    gaps = _gaps(received, every)
    return bool(gaps) and _in_bursts(gaps, statistics.fmean(gaps))
