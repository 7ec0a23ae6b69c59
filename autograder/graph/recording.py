"""What arrived on one topic; and the bag, in which messages are kept as they came over the wire, if asked."""

from __future__ import annotations

import base64
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol

from pydantic import BaseModel, ConfigDict
from rclpy.event_handler import SubscriptionEventCallbacks
from rclpy.node import Node
from rclpy.qos import QoSDurabilityPolicy, QoSHistoryPolicy, QoSPolicyKind, QoSProfile, QoSReliabilityPolicy
from rclpy.serialization import deserialize_message

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


_MESSAGE_OVERHEAD = 1024
"""Bytes that a message takes besides its own, about."""
_AT_ONCE = 50
"""Messages of one topic that are taken before others have their turn."""


class Recorder(Protocol):
    """Who records: an observer."""

    node: Node
    bag: Bag
    """Keeps what is received."""

    def room_for(self, size: int, kept: int) -> bool:
        """Take room for one more message of `size` bytes, for a recording that keeps `kept` bytes; False if none."""

    def notify(self) -> None:
        """Wake whoever waits: something happened."""

    def wait(self, ready: Callable[[], object], within: float) -> bool:
        """Wait until `ready()` is true; at most `within` seconds."""


def quiet_profile() -> QoSProfile:
    """Best effort, volatile, deep queue: compatible with every publisher, and deep enough for a grader that stalls."""
    return QoSProfile(
        reliability=QoSReliabilityPolicy.BEST_EFFORT,
        durability=QoSDurabilityPolicy.VOLATILE,
        history=QoSHistoryPolicy.KEEP_LAST,
        depth=5000,
    )


@dataclass(frozen=True)
class Received:
    """One message and what the middleware says about it."""

    msg: Any
    received: float
    """When the observer took it, seconds on the monotonic clock."""
    stamp: float
    """When it was published, seconds on the publisher's system clock (same machine, so comparable between topics)."""
    sequence: int
    """The publisher's own count of what it has published, from 1."""


class Recording:
    """All messages of a topic since the observer subscribed, in the order of arrival, while the observer has room."""

    def __init__(self, observer: Recorder, topic: str, msg_type: type, qos: QoSProfile) -> None:
        """Subscribe; use `Observer.record`, which shares recordings."""
        self.topic = topic
        self.msg_type = msg_type
        self.qos = qos
        self.incompatible: list[str] = []
        """Names of QoS policies over which a publisher and this subscription did not match."""
        self.alive = 0
        """Publishers that count as alive; a lease in the profile is needed to see one that hangs."""
        self._observer = observer
        self._messages: list[Received] = []
        self._kept = 0
        # Every publisher matches the quiet profile, and no lease runs: its events would only be waited for.
        quiet = qos == quiet_profile()
        # The observer's thread may take a first message before `create_subscription` has returned in this one.
        self._subscription: Any = None
        self._subscription = observer.node.create_subscription(
            msg_type,
            topic,
            self._take,
            qos,
            raw=True,
            event_callbacks=SubscriptionEventCallbacks(
                incompatible_qos=None if quiet else self._refused,
                liveliness=None if quiet else self._asserted,
                use_default_callbacks=False,
            ),
        )

    def _take(self, data: bytes, info: dict[str, int]) -> None:
        """Keep a message, and those that wait behind it.

        An executor takes one of each topic in a round. One that was held up would be behind with a topic that has many,
        while it knows already what was sent later on another.
        """
        self._keep(data, info)
        for _ in range(_AT_ONCE if self._subscription is not None else 0):
            with self._subscription.handle:
                taken = self._subscription.handle.take_message(self.msg_type, True)
            if taken is None:
                break
            self._keep(*taken)
        self._observer.notify()

    def _keep(self, data: bytes, info: dict[str, int]) -> None:
        size = len(data) + _MESSAGE_OVERHEAD
        if not self._observer.room_for(size, self._kept):
            return
        self._kept += size
        try:
            msg = deserialize_message(data, self.msg_type)
        except Exception:  # whatever a program sends that is no such message
            return
        stamp = info["source_timestamp"]
        self._observer.bag.add(self.topic, self.msg_type, stamp, data)
        self._messages.append(Received(msg, time.monotonic(), stamp * 1e-9, info["publication_sequence_number"]))

    def _refused(self, event: Any) -> None:
        self.incompatible.append(QoSPolicyKind(event.last_policy_kind).name)
        self._observer.notify()

    def _asserted(self, event: Any) -> None:
        self.alive = event.alive_count
        self._observer.notify()

    @property
    def messages(self) -> list[Received]:
        """What has arrived so far: a copy, so that it does not grow while it is looked at."""
        return list(self._messages)

    def messages_from(self, number: int) -> list[Received]:
        """Return what has arrived so far but for so many of the first."""
        return self._messages[number:]

    @property
    def count(self) -> int:
        """Number of messages so far."""
        return len(self._messages)

    @property
    def matched(self) -> int:
        """Number of publishers whose QoS this subscription accepted."""
        return int(self._subscription.get_publisher_count()) if self._subscription is not None else 0

    def wait_for(self, count: int, within: float = 10.0) -> bool:
        """Wait until at least `count` messages are there; at most `within` seconds."""
        return self._observer.wait(lambda: self.count >= count, within)
