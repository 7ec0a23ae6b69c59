"""Messages as they came over the wire, kept where somebody wants to look at a check closely; otherwise nobody does."""

from __future__ import annotations

import base64

from pydantic import BaseModel, ConfigDict

_ROOM = 16 * 1024 * 1024
"""Bytes of messages that are kept for one check."""


class BagMessage(BaseModel):
    """One message, serialised."""

    model_config = ConfigDict(extra="forbid")

    grade_id: str
    """The check that received it."""
    topic: str
    type: str
    """Such as `std_msgs/msg/String`."""
    stamp: int
    """When it was published, in nanoseconds on the publisher's system clock."""
    data: str
    """Its CDR, in base64."""


class Bag:
    """Keeps messages for one check after the other."""

    def __init__(self) -> None:
        """Keep nothing before somebody asks for it."""
        self.wanted = False
        self._taken: list[tuple[str, str, int, bytes]] = []
        self._room = _ROOM

    def add(self, topic: str, msg_type: type, stamp: int, data: bytes) -> None:
        """Keep a message, if anybody wants it and there is room."""
        if self.wanted and len(data) <= self._room:
            self._room -= len(data)
            package, kind, *_ = msg_type.__module__.split(".")
            self._taken.append((topic, f"{package}/{kind}/{msg_type.__name__}", stamp, data))

    def empty(self, grade_id: str) -> list[BagMessage]:
        """Return what was kept, as that of a check, and begin anew."""
        taken, self._taken, self._room = self._taken, [], _ROOM
        return [
            BagMessage(
                grade_id=grade_id, topic=topic, type=name, stamp=stamp, data=base64.b64encode(data).decode("ascii")
            )
            for topic, name, stamp, data in taken
        ]
