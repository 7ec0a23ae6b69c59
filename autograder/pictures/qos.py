"""Which publisher and which subscription of a topic match, and over which policy they do not."""

from __future__ import annotations

from collections.abc import Sequence

from autograder.core.results import Picture
from autograder.pictures.graph import Endpoint, Mismatch
from autograder.pictures.svg import SMALL, TEXT, WIDTH, Canvas, shortened

_ROW = 62.0


def qos(topic: str, endpoints: Sequence[Endpoint], mismatch: Mismatch) -> Picture:
    """Draw a table of pairs: publishers at the left with what they offer, subscriptions on top with what they request.

    Args:
        topic: full name.
        endpoints: of that topic.
        mismatch: says over which policy a publisher and a subscription do not match; None if they do.
    """
    offers = [end for end in endpoints if end.publishes]
    requests = [end for end in endpoints if not end.publishes]
    left, head = 290.0, 100.0
    column = (WIDTH - left - 16) / max(1, len(requests))
    canvas = Canvas(head + _ROW * max(1, len(offers)) + 16, WIDTH)
    canvas.words(12, 26, topic, bold=True)
    canvas.words(12, head - 12, "offered ↓", size=SMALL)
    canvas.words(left - 14, head - 12, "requested →", size=SMALL, anchor="end")
    for number, request in enumerate(requests):
        _end(canvas, left + column * number + 8, 34, request, column - 14)
    for row, offer in enumerate(offers):
        y = head + row * _ROW
        _end(canvas, 12, y + 24, offer, left - 24)
        for number, request in enumerate(requests):
            policy = mismatch(offer, request)
            x = left + column * number
            canvas.box(x, y, column, _ROW, fill="#ffffff" if policy is None else "#e4e4e4")
            symbol, words = ("✓", "match") if policy is None else ("✗", policy)
            canvas.words(x + column / 2, y + 27, symbol, size=24, anchor="middle", bold=True)
            canvas.words(x + column / 2, y + 50, shortened(words, column - 8, SMALL), size=SMALL, anchor="middle")
    if not offers or not requests:
        lacks = "publisher" if not offers else "subscription"
        canvas.words(left, head + 36, f"there is no {lacks}: nothing to match", italic=True)
    return canvas.picture(_alt(topic, offers, requests, mismatch))


def _end(canvas: Canvas, x: float, y: float, end: Endpoint, room: float) -> None:
    canvas.words(x, y, shortened(end.node, room, TEXT - 1), size=TEXT - 1)
    canvas.words(x, y + SMALL + 5, shortened(end.words(), room, SMALL - 1), size=SMALL - 1, fill="#444444")


def _alt(topic: str, offers: Sequence[Endpoint], requests: Sequence[Endpoint], mismatch: Mismatch) -> str:
    told = [f"Which ends of {topic or 'the topic'} match."]
    for offer in offers:
        for request in requests:
            policy = mismatch(offer, request)
            verdict = "match" if policy is None else f"do not match: {policy}"
            told.append(f"{offer.node} ({offer.words()}) and {request.node} ({request.words()}) {verdict}.")
    if not offers or not requests:
        told.append(f"There is no {'publisher' if not offers else 'subscription'}.")
    return " ".join(told)
