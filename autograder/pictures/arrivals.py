"""Draws when the messages of a topic came to each of its ends."""

from __future__ import annotations

import statistics
from collections.abc import Sequence
from dataclasses import dataclass

from autograder.core.results import Picture
from autograder.pictures.svg import SMALL, TEXT, WIDTH, Canvas, seconds_axis, shortened, width_of

_TOPIC_ROW = 58.0
_APART = 6.0
"""The least distance of two strokes, which are 2.6 wide."""


@dataclass(frozen=True)
class Traffic:
    """The messages of one end of a topic. Times are in seconds, from any common starting point."""

    who: str
    """The label of the end, such as `/camera publishes` or `/viewer takes`."""
    times: Sequence[float]
    since: float | None = None
    """When its node was created; None if that is not known."""
    total: int | None = None
    """How many messages there were, if `times` are only those of the first ones; None if they are all."""


def arrivals(
    topic: str, traffic: Sequence[Traffic], *, seconds: float | None = None, start: float | None = None
) -> Picture:
    """Draw a row for each end of a topic, and a stroke for each message.

    Of strokes that would touch each other, only the first is drawn; the picture says how many are left out.

    Args:
        topic: the full name of the topic.
        traffic: the messages of the publishers first, then those of the subscriptions.
        seconds: the time to draw; by default, all of it.
        start: the time at which to begin, in the time of the messages; by default, the first event.
    """
    every = [time for row in traffic for time in (*row.times, *([row.since] if row.since is not None else []))]
    zero = min(every, default=0.0) if start is None else start
    length = seconds or max(max(every, default=0.0) - zero, 0.1) * 1.02
    left = _left(traffic)
    bottom = 42 + _TOPIC_ROW * max(1, len(traffic))
    shown = drawn(traffic, seconds=length, start=zero)
    thinned = _thinned(traffic, shown, zero, length)
    canvas = Canvas(bottom + 2 * TEXT + (14 if not thinned else 20 + 1.5 * SMALL), WIDTH)
    canvas.words(8, 26, topic, bold=True)
    per_second = seconds_axis(canvas, left, 40, bottom, length)
    for number, row in enumerate(traffic):
        y = 42 + number * _TOPIC_ROW
        canvas.words(left - 10, y + 26, shortened(row.who, left - 22), anchor="end")
        canvas.words(left - 10, y + 26 + SMALL + 3, _said(row), size=SMALL, anchor="end", fill="#444444")
        canvas.line([(left, y + 48), (WIDTH - 24, y + 48)], line=1)
        if row.since is not None and 0 <= row.since - zero <= length:
            x = left + (row.since - zero) * per_second
            canvas.line([(x, y + 6), (x, y + 52)], dashed=True)
            canvas.words(x + 5, y + 18, "starts", size=SMALL - 1)
        for time in shown[number]:
            x = left + (time - zero) * per_second
            canvas.line([(x, y + 22), (x, y + 48)], line=2.6)
    if thinned:
        canvas.words(14, bottom + 2 * TEXT + 16 + SMALL, thinned, size=SMALL, italic=True)
    return canvas.picture(_arrivals_in_words(topic, traffic, thinned))


def drawn(traffic: Sequence[Traffic], *, seconds: float, start: float) -> list[list[float]]:
    """Return the times of the strokes that `arrivals` draws in each row."""
    least = _least(traffic, seconds)
    return [_apart(row.times, start, seconds, least) for row in traffic]


def _left(traffic: Sequence[Traffic]) -> float:
    """Return where the rows begin, to the right of their labels."""
    widths = (max(width_of(row.who), width_of(_said(row), SMALL)) for row in traffic)
    return 24 + min(280.0, max(widths, default=80.0) + 8)


def _least(traffic: Sequence[Traffic], length: float) -> float:
    """Return the seconds that two strokes have to be apart."""
    return _APART * length / (WIDTH - 24 - _left(traffic))


def _apart(times: Sequence[float], zero: float, length: float, least: float) -> list[float]:
    """Return the times that are drawn: those in the picture, at least `least` seconds after the one before."""
    found: list[float] = []
    for time in times:
        if 0 <= time - zero <= length and (not found or time - found[-1] >= least):
            found.append(time)
    return found


def _thinned(traffic: Sequence[Traffic], shown: Sequence[Sequence[float]], zero: float, length: float) -> str:
    """Return a sentence about the strokes that are left out; empty if none is."""
    there = sum(len(_apart(row.times, zero, length, 0.0)) for row in traffic)
    strokes = sum(map(len, shown))
    if strokes == there:
        return ""
    least = _least(traffic, length)
    return f"{strokes} of {there} messages are drawn: none that came within {least:.2g} s of the stroke before."


def _said(row: Traffic) -> str:
    number = len(row.times)
    if row.total is not None and row.total > number:
        return f"the first {number} of {row.total} messages"
    return f"{number} message{'s' * (number != 1)}"


def _arrivals_in_words(topic: str, traffic: Sequence[Traffic], thinned: str) -> str:
    told = [f"Messages of {topic}, a stroke for each.{f' {thinned}' if thinned else ''}"]
    for row in traffic:
        gaps = [later - earlier for earlier, later in zip(row.times, row.times[1:], strict=False)]
        rhythm = f", usually every {statistics.median(gaps):.2f} s, at most {max(gaps):.2f} s apart" if gaps else ""
        told.append(f"{row.who}: {_said(row)}{rhythm}.")
    return " ".join(told)
