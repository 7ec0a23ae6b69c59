"""Reads what a program's probe writes.

A line that does not have the form of an event is ignored, because a program can forge its lines.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Annotated, Any

from pydantic import Field, TypeAdapter, ValidationError

from autograder.sandbox.inside.probe.events import Event

_READER: TypeAdapter[Event] = TypeAdapter(Annotated[Event, Field(discriminator="e")])


def read(lines: Iterable[dict[str, Any]]) -> list[Event]:
    """The events that have the form of one, in their order."""
    found = []
    for line in lines:
        try:
            found.append(_READER.validate_python(line))
        except ValidationError:
            continue
    return found
