"""Answers the questions about a record by going through it event by event, which the kit's own keys never do."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

from rclpy.duration import Duration
from rclpy.qos import (
    DurabilityPolicy,
    LivelinessPolicy,
    QoSCompatibility,
    QoSProfile,
    ReliabilityPolicy,
    qos_check_compatible,
)

from autograder.own_run.question import Question
from autograder.own_run.record import Record
from autograder.pictures import Endpoint, Run


@dataclass
class Moment:
    """What a replay of a record has seen up to some event."""

    time: float
    what: str
    """`begin`, `end`, `sent`, `taken` or `starts`."""
    run: Run | None = None
    topic: str = ""
    who: str = ""
    """The end of the topic."""
    running: list[Run] = field(default_factory=list)
    """After this event."""


def replay(record: Record) -> Iterator[Moment]:
    """Go through a record event by event, as it happened, which `keys` never does."""
    events = [(run.begin, "begin", run, "", "") for run in record.runs]
    events += [(run.end, "end", run, "", "") for run in record.runs]
    for topic, rows in record.traffic.items():
        for row in rows:
            what = "sent" if "publishes" in row.who else "taken"
            events += [(time, what, None, topic, row.who) for time in row.times]
            events += [(row.since, "starts", None, topic, row.who)] if row.since is not None else []
    running: list[Run] = []
    for time, what, run, topic, who in sorted(events, key=lambda event: event[0]):
        if run is not None and what == "begin":
            running.append(run)
        elif run is not None and run in running:
            running.remove(run)
        yield Moment(time, what, run, topic, who, list(running))


def _profile(end: Endpoint) -> QoSProfile:
    told = {name: value for name, value in end.policies.items() if value is not None}
    return QoSProfile(
        depth=1,
        reliability=ReliabilityPolicy[told["reliability"].upper()],
        durability=DurabilityPolicy[told["durability"].upper()],
        liveliness=LivelinessPolicy[told["liveliness"].upper()],
        deadline=Duration(seconds=told.get("deadline", 0)),
        liveliness_lease_duration=Duration(seconds=told.get("lease", 0)),
    )


def _refused(offer: Endpoint, request: Endpoint) -> str:
    """Why two ends do not match, as rclpy says it; empty if they do."""
    verdict, why = qos_check_compatible(_profile(offer), _profile(request))
    return "" if verdict == QoSCompatibility.OK else why


_SAID = {
    "reliability": "Best effort publisher",
    "durability": "Volatile publisher",
    "deadline": "deadline",
    "liveliness lease": "lease duration",
    "liveliness": "liveliness",
}
"""Words of rclpy about each policy."""


def about_ends(record: Record, question: Question) -> str:
    """The answer to a question about two kinds of ends of a topic."""
    ends = [end for end in record.ends if end.topic == question.about["topic"]]
    offer = [end for end in ends if end.publishes][question.about["publisher"] - 1]
    requests = [end for end in ends if not end.publishes]
    if question.kind == "matching":
        return str(len([end for end in requests if not _refused(offer, end)]))
    why = _refused(offer, requests[question.about["subscription"] - 1])
    return next((policy for policy, words in _SAID.items() if words in why), why) if why else "they match"


def about_messages(record: Record, question: Question) -> str:
    """The answer to a question about the messages that one subscription took."""
    about, sent = question.about, 0
    taken: list[float] = []
    for moment in replay(record):
        if moment.topic != about["topic"]:
            continue
        mine = moment.who == about["who"]
        if question.kind == "first_taken" and taken and moment.what == "sent":
            # A publication is noted when the call returns, which may be after its message was taken.
            return str(sent + (moment.time - taken[0] < 0.015))
        if mine and (moment.what, question.kind) == ("starts", "sent_before_start"):
            return str(sent)
        counts = question.kind != "taken_between" or about["begin"] < moment.time < about["end"]
        if mine and moment.what == "taken" and counts:
            taken.append(moment.time)
        sent += moment.what == "sent"
    return str(sent if question.kind == "first_taken" else len(taken))


def answer(record: Record, question: Question) -> str:
    """The answer to a question by replaying the record."""
    if question.view == "qos":
        return about_ends(record, question)
    if "who" in question.about:
        return about_messages(record, question)
    about, moments = question.about, list(replay(record))
    node, callback = about.get("node"), about.get("callback")
    of_node = [m for m in moments if m.run is not None and m.run.node == node]
    begins = [m for m in of_node if m.what == "begin"]
    if question.kind == "under_way":
        before = [m for m in moments if m.time <= about["time"]]
        return str(len([run for run in before[-1].running if run.node == node]))
    if question.kind == "on_thread":
        before = [m for m in moments if m.time <= about["time"]]
        (run,) = [run for run in before[-1].running if run.node == node and run.thread == about["thread"]]
        return run.callback
    if question.kind == "waited_for":
        group = next(m.run.group for m in begins if m.run.callback == callback)
        ended = [m for m in of_node if m.what == "end" and m.run.group == group and m.run.end - m.run.begin > 0.02]
        return min(ended, key=lambda m: abs(m.time - about["time"])).run.callback
    if question.kind == "began_during":
        return str(len([m for m in begins if m.run.callback == callback and about["begin"] < m.time < about["end"]]))
    if question.kind in ("longest_pause", "longest_silence"):
        times = [
            m.time
            for m in (begins if node else moments)
            if (m.run.callback == callback if node else m.topic == about["topic"] and m.what == "sent")
        ]
        best = 0
        for number in range(1, len(times) - 1):
            if times[number + 1] - times[number] > times[best + 1] - times[best]:
                best = number
        return f"{times[best]:.2f} s" if node else str(best + 1)
    if question.kind == "thread_of":
        return str(next(m.run.thread for m in begins if m.run.callback == callback and m.time >= about["begin"]))
    if question.kind == "longest_transition":
        taken = {}
        for moment in moments:
            if moment.what == "end" and moment.run.callback.startswith("on_") and not moment.run.group:
                taken[moment.run.end - moment.run.begin] = f"{moment.run.callback} of {moment.run.node}"
        return taken[max(taken)]
    if question.kind == "transitions":
        began = ("configuring", "activating", "deactivating", "cleaningup", "shuttingdown")
        return str(len([change for change in record.changes if change.node == node and change.goal in began]))
    if question.kind == "transition_under_way":
        running = [m.running for m in moments if m.time <= about["time"]][-1]
        names = [f"{run.callback} of {run.node}" for run in running]
        return next((name for name in names if name in question.choices), "none of them")
    assert question.kind == "sent_between"
    return str(
        len(
            [
                m
                for m in moments
                if m.topic == about["topic"] and m.what == "sent" and about["begin"] < m.time < about["end"]
            ]
        )
    )
