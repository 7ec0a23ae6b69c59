"""Finds questions about the topics of a record: when messages were sent and taken, and which ends match."""

from __future__ import annotations

import statistics
from collections.abc import Callable, Iterator, Sequence
from itertools import pairwise, product

from autograder.graph.qos import mismatches
from autograder.own_run.moments import EDGE, SOME, apart, countable
from autograder.own_run.question import Question
from autograder.own_run.record import SECONDS, Record
from autograder.pictures import Endpoint, Traffic

THEY_MATCH = "they match"
_POLICIES = ("reliability", "durability", "deadline", "liveliness", "liveliness lease")
_LATER = (0.0, 0.02, 0.04)
"""Seconds by which windows are moved, because otherwise messages every 50 ms might all lie at the edges of windows."""
_LEAST_REQUESTS = 3
"""The number of subscriptions from which on it is a question how many of them match."""


def sent_while_active(record: Record) -> Iterator[Question]:
    """Ask how many messages a lifecycle node published on a topic while it was active."""
    for topic, times, who in _sent(record):
        for begin, end in record.active(who):
            inside = [time for time in times if begin < time < end]
            if end < SECONDS and countable(inside) and apart(times, begin, end):
                yield Question(
                    kind="sent_between",
                    about={"topic": topic, "begin": begin, "end": end},
                    text=f"`{who}` was active from {begin:.2f} s to {end:.2f} s. How many messages did it publish on"
                    f" `{topic}` in this time?",
                    view="arrivals",
                    subject=topic,
                )


def sent_between(record: Record, surprising: bool = True) -> Iterator[Question]:
    """Ask how many messages of a topic were published in a short time.

    Args:
        record: of a run.
        surprising: only where the usual rate does not tell the number.
    """
    for topic, times, _ in _sent(record):
        for begin, end in _windows(times, surprising):
            yield Question(
                kind="sent_between",
                about={"topic": topic, "begin": begin, "end": end},
                text=f"How many messages were published on `{topic}` from {begin:.2f} s to {end:.2f} s?",
                view="arrivals",
                subject=topic,
            )


def taken_between(record: Record) -> Iterator[Question]:
    """Ask how many messages a subscription took in a short time."""
    for topic, rows in sorted(record.traffic.items()):
        for row in _takers(rows):
            for begin, end in _windows(row.times, surprising=True):
                yield Question(
                    kind="taken_between",
                    about={"topic": topic, "who": row.who, "begin": begin, "end": end},
                    text=f"How many messages of `{topic}` did the subscription `{_name(row)}` take from"
                    f" {begin:.2f} s to {end:.2f} s?",
                    view="arrivals",
                    subject=topic,
                )


def sent_at_its_rate(record: Record) -> Iterator[Question]:
    """Ask how many messages of a topic were published in a short time, also where the usual rate tells the number."""
    yield from sent_between(record, surprising=False)


def _windows(times: Sequence[float], surprising: bool) -> Iterator[tuple[float, float]]:
    """Yield times between which messages can be counted; if surprising, the usual rate does not tell how many."""
    last = int(20 * max(times, default=0.0))
    usual = statistics.median(two - one for one, two in pairwise(times)) if len(times) > 3 else 0.0
    for twentieth, later in product(range(2, last - 8), _LATER) if len(times) > 3 else ():
        begin = round(twentieth / 20 + later, 2)
        end = round(min(twentieth + 6 + 5 * (twentieth % 3), last) / 20 + later, 2)
        inside = [time for time in times if begin < time < end]
        told = usual > 0.0 and abs((end - begin) / usual - len(inside)) <= SOME
        if inside and not (surprising and told) and countable(inside) and apart(times, begin, end):
            yield begin, end


def longest_silence(record: Record) -> Iterator[Question]:
    """Ask after which message of a topic the longest silence came."""
    for topic, times, _ in _sent(record):
        gaps = sorted((two - one for one, two in pairwise(times)), reverse=True)
        if len(times) >= 4 and countable(times) and gaps[0] > max(1.15 * gaps[1], gaps[1] + EDGE):
            yield Question(
                kind="longest_silence",
                about={"topic": topic},
                text=f"After which message on `{topic}` was the time until the next one the longest?"
                " The first message is number 1.",
                view="arrivals",
                subject=topic,
            )


def sent_before_start(record: Record) -> Iterator[Question]:
    """Ask how many messages had been published on a topic when the node of a subscription started."""
    for topic, times, _ in _sent(record):
        for row in _takers(record.traffic[topic]):
            before = [time for time in times if row.since is not None and time < row.since]
            if row.since is not None and len(before) >= SOME and countable(before) and apart(times, row.since):
                yield Question(
                    kind="sent_before_start",
                    about={"topic": topic, "who": row.who},
                    text=f"How many messages had been published on `{topic}` when the node of the subscription"
                    f" `{_name(row)}` started?",
                    view="arrivals",
                    subject=topic,
                )


def first_taken(record: Record) -> Iterator[Question]:
    """Ask which message was the first that a late subscription took, if it also took each later one, and no older one.

    The stroke of a message that is published may be a little later than that of its arrival, because the probe notes a
    publication when the call returns.
    """
    for topic, times, _ in _sent(record):
        for row in _takers(record.traffic[topic]):
            first = row.times[0] if row.times else 0.0
            before, after = [t for t in times if t < first + EDGE], [t for t in times if t >= first + EDGE]
            if len(before) <= SOME or not countable(before) or first - before[-1] >= EDGE:
                continue
            near = [time for time in (*before[:-1], *after) if abs(time - first) < 2 * EDGE]
            sent = pairwise([time - EDGE for time in (before[-1], *after)])
            if not near and all(sum(begin < time < end for time in row.times) == 1 for begin, end in sent):
                yield Question(
                    kind="first_taken",
                    about={"topic": topic, "who": row.who},
                    text=f"Which message on `{topic}` was the first that the subscription `{_name(row)}` took?"
                    " The first one that was published is number 1.",
                    view="arrivals",
                    subject=topic,
                )


def mismatch(record: Record) -> Iterator[Question]:
    """Ask which policy keeps a publisher and a subscription apart, on a topic where some match and others do not."""
    for topic, offers, requests in _ends(record):
        found = {
            (p, s): mismatches(offer.policies, request.policies)
            for (p, offer), (s, request) in product(enumerate(offers, 1), enumerate(requests, 1))
        }
        if len(found) < SOME or not any(found.values()):
            continue
        for (p, s), policies in found.items():
            if len(policies) < SOME:
                yield Question(
                    kind="mismatch",
                    about={"topic": topic, "publisher": p, "subscription": s},
                    text=f"Which policy keeps the publisher P{p} and the subscription S{s} of `{topic}` apart?",
                    choices=(*_POLICIES, THEY_MATCH),
                    view="qos",
                    subject=topic,
                )


def matching(record: Record) -> Iterator[Question]:
    """Ask how many subscriptions of a topic match a publisher."""
    for topic, offers, requests in _ends(record):
        for p, offer in enumerate(offers, 1) if len(requests) >= _LEAST_REQUESTS else ():
            if any(mismatches(offer.policies, request.policies) for request in requests):
                yield Question(
                    kind="matching",
                    about={"topic": topic, "publisher": p},
                    text=f"How many of the {len(requests)} subscriptions of `{topic}` match the publisher P{p}?",
                    view="qos",
                    subject=topic,
                )


def _ends(record: Record) -> Iterator[tuple[str, list[Endpoint], list[Endpoint]]]:
    """Yield each topic that has publishers and subscriptions, with both in the order of its picture."""
    for topic in sorted({end.topic for end in record.ends if not end.action}):
        ends = [end for end in record.ends if end.topic == topic]
        offers, requests = [end for end in ends if end.publishes], [end for end in ends if not end.publishes]
        if offers and requests:
            yield topic, offers, requests


def _sent(record: Record) -> Iterator[tuple[str, list[float], str]]:
    """Yield each topic that one node of the programs published, with the times of the messages and the node."""
    for topic, rows in sorted(record.traffic.items()):
        publishers = [row for row in rows if row.who.endswith(" publishes") and row.times]
        nodes = {row.who.removesuffix(" publishes") for row in publishers}
        if len(nodes) == 1:
            yield topic, sorted(time for row in publishers for time in row.times), nodes.pop()


def _takers(rows: Sequence[Traffic]) -> list[Traffic]:
    return [row for row in rows if " takes" in row.who]


def _name(row: Traffic) -> str:
    """Return the label of a subscription without its verb: `/viewer`, or `/viewer (2)` of several."""
    return row.who.replace(" takes", "")


KINDS: tuple[Callable[[Record], Iterator[Question]], ...] = (
    sent_while_active, sent_between, taken_between, longest_silence, sent_before_start, first_taken, mismatch, matching,
)  # fmt: skip
