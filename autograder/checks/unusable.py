"""Data with which no check can go on, such as a stamp of -1 s: what a check is told that broke because of it.

A check that breaks says nothing about the student by itself. Where the programs sent something that no arithmetic
takes, that is the reason, and the part is lost. Where nothing of the kind is found, nobody could find out. Either way
the result carries a flag: a person looks at it.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from itertools import islice
from typing import Any

from autograder.checks import current
from autograder.checks.misuse import Misuse
from autograder.core.errors import KitError
from autograder.graph.observer import Observer
from autograder.graph.recording import Recording


class OutOfBudget(Exception):
    """A check has taken more of the grader's own CPU than it may, which only data of the student's can bring about."""


_MESSAGES = 200
"""Messages of a topic that are looked at: so many of the first, and so many of the last."""
_ELEMENTS = 10_000
"""Elements of a list that are looked at."""
_LONG_TEXT, _LONG_LIST = 10_000, 100_000
"""A text of so many characters, or a list of so many elements, is no answer to anything that a lab asks. A list of
bytes may be one: an image of 640 by 480 points has 921,600."""
_FLOOD = 20_000
"""So many messages on one topic are no answer, either."""
_OF_RANGES = ("range", "ranges")
"""Fields of sensor_msgs in which infinities and NaN have a meaning (REP 117)."""
_MANY_DIGITS = re.compile(r"\d{400}")
"""What is no float any more; from 4,301 digits on, Python makes no int of it, either."""


def broke(error: BaseException, place: str) -> None:
    """Flag that a check broke, if anything of the student's had come in by then.

    Args:
        error: with which it broke.
        place: where in the check cell, or nothing.
    """
    if not current.check.findings.used:
        return
    where = f" ({place})" if place else ""
    current.check.findings.flags.append(
        f"A check broke after programs or files of this submission had come in: {type(error).__name__}:"
        f" {str(error)[:200]}{where}. Data that nobody expected can bring that about, and so can a mistake in the"
        " check. Look at the programs and at what they printed before you decide about the points."
    )


def reason(error: BaseException) -> str:
    """What the programs of the launch have sent that explains why a check broke, a sentence; empty if nothing does.

    Args:
        error: with which it broke. One of the kit's or of the machine's is explained by nothing that a program sends.
    """
    block = current.check.block
    if block is None or not isinstance(error, Exception) or isinstance(error, (KitError, Misuse, OSError)):
        return ""
    for where, message in _received(block.observer):
        for path, why in _odd(message, "", texts="/rosout" not in where):
            return f"{where} holds {path}; {why}. The check cannot go on with that."
    if isinstance(error, (OutOfBudget, MemoryError)):
        for recording in _recordings(block.observer):
            if recording.count >= _FLOOD:
                return f"{recording.count:,} messages came on `{recording.topic}`, too many for the check to go on."
    return ""


def _recordings(observer: Observer) -> list[Recording]:
    """What was heard on the topics on which the check itself sends nothing."""
    own = observer.sends_on()
    return [recording for recording in observer.recordings() if recording.topic not in own]


def _received(observer: Observer) -> Iterator[tuple[str, Any]]:
    """What came last, of each topic, and the answers of services and actions; where from, and the message."""
    for name, message in list(observer.answers):
        yield f"An answer of `{name}`", message
    for recording in _recordings(observer):
        heard = recording.messages
        for one in [*heard[-_MESSAGES:], *heard[: max(0, min(_MESSAGES, len(heard) - _MESSAGES))]]:
            yield f"A message on `{recording.topic}`", one.msg


def _odd(value: Any, path: str, *, texts: bool) -> Iterator[tuple[str, str]]:
    """The places in a message at which there is something that cannot be used, and why."""
    if hasattr(value, "get_fields_and_field_types"):
        yield from _odd_fields(value, path, texts=texts)
    elif isinstance(value, float) and not math.isfinite(value):
        yield f"`{path}` = {value}", "that is not a finite number"
    elif isinstance(value, str):
        if _MANY_DIGITS.search(value):
            yield f"`{path}`, a number of more than 400 digits", "that is too large for any computation"
        elif texts and len(value) > _LONG_TEXT:
            yield f"`{path}`, a text of {len(value):,} characters", "that is far longer than any answer"
    elif hasattr(value, "__len__") and not _of_bytes(value):
        if len(value) > _LONG_LIST:
            yield f"`{path}`, a list of {len(value):,} elements", "that is far longer than any answer"
        for element in islice(value, _ELEMENTS):
            if isinstance(element, (bool, int)):
                break  # so are all the others
            if not isinstance(element, float) or not math.isfinite(element):
                yield from _odd(element, path, texts=texts)


def _odd_fields(message: Any, path: str, *, texts: bool) -> Iterator[tuple[str, str]]:
    kind = type(message)
    if kind.__module__.startswith("builtin_interfaces.") and kind.__name__ == "Time":  # a Duration may be below 0
        sec, nanosec = f"{path}.sec".lstrip("."), f"{path}.nanosec".lstrip(".")
        if message.sec < 0:
            yield f"`{sec}` = {message.sec}", "that is no valid time: `sec` must be 0 or more"
        elif message.nanosec >= 1e9:
            wrong = "that is no valid time: `nanosec` must be less than 1,000,000,000"
            yield f"`{nanosec}` = {message.nanosec}", wrong
    for name in message.get_fields_and_field_types():
        if not (kind.__module__.startswith("sensor_msgs.") and name in _OF_RANGES):
            yield from _odd(getattr(message, name), f"{path}.{name}".lstrip("."), texts=texts)


def _of_bytes(values: Any) -> bool:
    """Whether a list holds bytes: an array of them, or what a field of the type `byte` is to Python."""
    return (
        isinstance(values, (bytes, bytearray))
        or getattr(values, "itemsize", 0) == 1
        or isinstance(next(iter(values), None), bytes)
    )
