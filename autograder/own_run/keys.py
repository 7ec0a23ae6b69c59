"""Finds the right answers to the questions about a record. Students do not get this module."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

from autograder import pictures
from autograder.graph.qos import mismatch_between, mismatches
from autograder.own_run.moments import EDGE
from autograder.own_run.question import Question
from autograder.own_run.questions import NONE
from autograder.own_run.record import Record
from autograder.own_run.topic_questions import THEY_MATCH
from autograder.pictures import Endpoint, Traffic


def key(record: Record, question: Question) -> str:
    """Return the right answer to a question: one of its choices, or a whole number."""
    return str(_KEYS[question.kind](record, **question.about))


def _under_way(record: Record, node: str, time: float) -> int:
    return sum(run.begin <= time <= run.end for run in record.callbacks[node])


def _on_thread(record: Record, node: str, thread: int, time: float) -> str:
    runs = record.callbacks[node]
    return next(run.callback for run in runs if run.thread == thread and run.begin <= time <= run.end)


def _transition_under_way(record: Record, time: float) -> str:
    running = [run for run in record.runs if run.callback.startswith("on_") and run.begin <= time <= run.end]
    return f"{running[0].callback} of {running[0].node}" if running else NONE


def _waited_for(record: Record, node: str, callback: str, time: float) -> str:
    """Return the callback that ended last before the late one began."""
    before = [run for run in record.callbacks[node] if run.callback != callback and run.begin < time]
    group = next(run.group for run in record.callbacks[node] if run.callback == callback)
    return min((run for run in before if run.group == group), key=lambda run: abs(time - run.end)).callback


def _began_during(record: Record, node: str, callback: str, begin: float, end: float) -> int:
    return sum(begin < run.begin < end for run in record.callbacks[node].of(callback))


def _longest_pause(record: Record, node: str, callback: str) -> str:
    begins = [run.begin for run in record.callbacks[node].of(callback)]
    return f"{max(pairwise(begins), key=lambda pair: pair[1] - pair[0])[0]:.2f} s"


def _thread_of(record: Record, node: str, callback: str, begin: float) -> int:
    return next(run.thread for run in record.callbacks[node].of(callback) if run.begin == begin)


def _longest_transition(record: Record) -> str:
    runs = [run for run in record.runs if run.callback.startswith("on_") and run.group == ""]
    longest = max(runs, key=lambda run: run.end - run.begin)
    return f"{longest.callback} of {longest.node}"


def _transitions(record: Record, node: str) -> int:
    return len(pictures.steps(record.steps(node)))


def _sent_between(record: Record, topic: str, begin: float, end: float) -> int:
    return sum(begin < time < end for time in _times(record, topic))


def _taken_between(record: Record, topic: str, who: str, begin: float, end: float) -> int:
    return sum(begin < time < end for time in _row(record, topic, who).times)


def _sent_before_start(record: Record, topic: str, who: str) -> int:
    since = _row(record, topic, who).since
    return sum(since is not None and time < since for time in _times(record, topic))


def _first_taken(record: Record, topic: str, who: str) -> int:
    first = _row(record, topic, who).times[0]
    return sum(time < first + EDGE for time in _times(record, topic))


def _row(record: Record, topic: str, who: str) -> Traffic:
    return next(row for row in record.traffic[topic] if row.who == who)


def _mismatch(record: Record, topic: str, publisher: int, subscription: int) -> str:
    offer, request = _ends(record, topic, True)[publisher - 1], _ends(record, topic, False)[subscription - 1]
    return mismatch_between(offer.policies, request.policies) or THEY_MATCH


def _matching(record: Record, topic: str, publisher: int) -> int:
    offer = _ends(record, topic, True)[publisher - 1]
    return sum(not mismatches(offer.policies, request.policies) for request in _ends(record, topic, False))


def _ends(record: Record, topic: str, publishes: bool) -> list[Endpoint]:
    return [end for end in record.ends if end.topic == topic and end.publishes == publishes]


def _longest_silence(record: Record, topic: str) -> int:
    times = _times(record, topic)
    gaps = [two - one for one, two in pairwise(times)]
    return gaps.index(max(gaps)) + 1


def _times(record: Record, topic: str) -> list[float]:
    rows = [row for row in record.traffic[topic] if row.who.endswith(" publishes")]
    return sorted(time for row in rows for time in row.times)


_KEYS: dict[str, Any] = {
    "under_way": _under_way,
    "on_thread": _on_thread,
    "waited_for": _waited_for,
    "began_during": _began_during,
    "longest_pause": _longest_pause,
    "thread_of": _thread_of,
    "longest_transition": _longest_transition,
    "transitions": _transitions,
    "transition_under_way": _transition_under_way,
    "sent_between": _sent_between,
    "taken_between": _taken_between,
    "sent_before_start": _sent_before_start,
    "first_taken": _first_taken,
    "mismatch": _mismatch,
    "matching": _matching,
    "longest_silence": _longest_silence,
}
