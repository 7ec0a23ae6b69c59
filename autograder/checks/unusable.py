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

from autograder.checks import findings, runtime
from autograder.checks.misuse import Misuse
from autograder.core.errors import KitError

_MESSAGES = 200
"""Messages of a topic that are looked at: so many of the first, and so many of the last."""
_ELEMENTS = 10_000
"""Elements of a list that are looked at."""
_LONG_TEXT, _LONG_LIST = 10_000, 100_000
"""A text of so many characters, or a list of so many elements, is no answer to anything that a lab asks."""
_MANY_DIGITS = re.compile(r"\d{400}")
"""What is no float any more; from 4,301 digits on, Python makes no int of it, either."""


def broke(error: BaseException, place: str) -> None:
    """Flag that a check broke, if anything of the student's had come in by then.

    Args:
        error: with which it broke.
        place: where in the check cell, or nothing.
    """
    if not findings.current.used:
        return
    where = f" ({place})" if place else ""
    findings.current.flags.append(
        f"A check broke after programs or files of this submission had come in: {type(error).__name__}:"
        f" {str(error)[:200]}{where}. Data that nobody expected can bring that about, and so can a mistake in the"
        " check. Look at the programs and at what they printed before you decide about the points."
    )


def reason(error: BaseException) -> str:
    """What the programs of the launch have sent that explains why a check broke, a sentence; empty if nothing does.

    Args:
        error: with which it broke. One of the kit's or of the machine's is explained by nothing that a program sends.
    """
    block = runtime.current.block
    if block is None or not isinstance(error, Exception) or isinstance(error, (KitError, Misuse, OSError, MemoryError)):
        return ""
    for where, message in _received(block.observer):
        for path, why in _odd(message, "", texts="/rosout" not in where):
            return f"{where} holds {path}: {why}. The check cannot go on with that."
    return ""


def _received(observer: Any) -> Iterator[tuple[str, Any]]:
    """What came last, of each topic, and the answers of services and actions; where from, and the message."""
    for name, message in list(observer.answers):
        yield f"An answer of `{name}`", message
    for recording in observer.recordings():
        heard = recording.messages
        for one in [*heard[-_MESSAGES:], *heard[: max(0, min(_MESSAGES, len(heard) - _MESSAGES))]]:
            yield f"A message on `{recording.topic}`", one.msg


def _odd(value: Any, path: str, *, texts: bool) -> Iterator[tuple[str, str]]:
    """The places in a message at which there is something that cannot be used, and why."""
    if hasattr(value, "get_fields_and_field_types"):
        fields = value.get_fields_and_field_types()
        if set(fields) == {"sec", "nanosec"} and (value.sec < 0 or value.nanosec >= 1e9):
            yield (
                f"`{f'{path}.sec' if path else 'sec'}` = {value.sec} and `nanosec` = {value.nanosec}",
                "no time, which has 0 seconds or more, and less than 1,000,000,000 nanoseconds",
            )
        for name in fields:
            yield from _odd(getattr(value, name), f"{path}.{name}" if path else name, texts=texts)
    elif isinstance(value, float) and not math.isfinite(value):
        yield f"`{path}` = {value}", "not a finite number"
    elif isinstance(value, str):
        if _MANY_DIGITS.search(value):
            yield f"`{path}`, a number of more than 400 digits", "too large for any computation"
        elif texts and len(value) > _LONG_TEXT:
            yield f"`{path}`, a text of {len(value):,} characters", "far longer than any answer"
    elif hasattr(value, "__len__") and not isinstance(value, (bytes, bytearray)):
        if len(value) > _LONG_LIST:
            yield f"`{path}`, a list of {len(value):,} elements", "far longer than any answer"
        for element in islice(value, _ELEMENTS):
            if isinstance(element, (bool, int)):
                break  # so are all the others
            yield from _odd(element, path, texts=texts)
