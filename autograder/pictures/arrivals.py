"""Arrivals: when each message of a topic was published, and when each subscription's callback got one."""

from __future__ import annotations

import statistics
from collections.abc import Sequence
from dataclasses import dataclass

from autograder.core.results import Picture
from autograder.pictures.svg import SMALL, TEXT, WIDTH, Canvas, seconds_axis, shortened, width_of

_ROW = 58.0


@dataclass(frozen=True)
class Traffic:
    """The messages of one end of a topic. Times are seconds, from any common beginning."""

    who: str
    """`/camera publishes`, `/viewer takes`."""
    times: Sequence[float]
    since: float | None = None
    """When its node was made; None: nobody knows."""


def arrivals(topic: str, traffic: Sequence[Traffic], *, seconds: float | None = None) -> Picture:
    """Draw a row for each end of a topic, and a stroke for each message.

    Args:
        topic: full name.
        traffic: of the publishers first, then of those who take the messages.
        seconds: how much to draw from the first event on; by default all of it.
    """
    every = [time for row in traffic for time in (*row.times, *([row.since] if row.since is not None else []))]
    zero = min(every, default=0.0)
    length = seconds or max(max(every, default=0.0) - zero, 0.1) * 1.02
    left = 24 + min(280.0, max((width_of(row.who) for row in traffic), default=80.0) + 8)
    bottom = 42 + _ROW * max(1, len(traffic))
    canvas = Canvas(bottom + 2 * TEXT + 14, WIDTH)
    canvas.words(8, 26, topic, bold=True)
    per_second = seconds_axis(canvas, left, 40, bottom, length)
    for number, row in enumerate(traffic):
        y = 42 + number * _ROW
        canvas.words(left - 10, y + 26, shortened(row.who, left - 22), anchor="end")
        canvas.words(left - 10, y + 26 + SMALL + 3, _said(row), size=SMALL, anchor="end", fill="#444444")
        canvas.line([(left, y + 48), (WIDTH - 24, y + 48)], line=1)
        if row.since is not None and 0 <= row.since - zero <= length:
            x = left + (row.since - zero) * per_second
            canvas.line([(x, y + 6), (x, y + 52)], dashed=True)
            canvas.words(x + 5, y + 18, "starts", size=SMALL - 1)
        for time in row.times:
            if 0 <= time - zero <= length:
                x = left + (time - zero) * per_second
                canvas.line([(x, y + 22), (x, y + 48)], line=2.6)
    return canvas.picture(_alt(topic, traffic))


def _said(row: Traffic) -> str:
    return f"{len(row.times)} message{'s' * (len(row.times) != 1)}"


def _alt(topic: str, traffic: Sequence[Traffic]) -> str:
    told = [f"Messages of {topic}, a stroke for each."]
    for row in traffic:
        gaps = [later - earlier for earlier, later in zip(row.times, row.times[1:], strict=False)]
        rhythm = f", usually every {statistics.median(gaps):.2f} s, at most {max(gaps):.2f} s apart" if gaps else ""
        told.append(f"{row.who}: {_said(row)}{rhythm}.")
    return " ".join(told)
