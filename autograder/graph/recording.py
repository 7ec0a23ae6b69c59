"""Recordings of the messages on a topic, and the bag, which keeps serialised messages if that is requested."""

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
"""The bytes of messages that are kept for one check."""


class BagMessage(BaseModel):
    """One message, serialised."""

    model_config = ConfigDict(extra="forbid")

    grade_id: str
    """The check that received it."""
    topic: str
    type: str
    """The type name, such as `std_msgs/msg/String`."""
    stamp: int
    """When it was published, in nanoseconds on the publisher's system clock."""
    data: str
    """The message in CDR, encoded in base64."""


class Bag:
    """Keeps the messages of one check after another."""

    def __init__(self) -> None:
        """Begin empty; nothing is kept until `wanted` is set."""
        self.wanted = False
        self._taken: list[tuple[str, str, int, bytes]] = []
        self._room = _ROOM

    def add(self, topic: str, msg_type: type, stamp: int, data: bytes) -> None:
        """Keep a message if messages are wanted and there is room."""
        if self.wanted and len(data) <= self._room:
            self._room -= len(data)
            package, kind, *_ = msg_type.__module__.split(".")
            self._taken.append((topic, f"{package}/{kind}/{msg_type.__name__}", stamp, data))

    def empty(self, grade_id: str) -> list[BagMessage]:
        """Return the messages that were kept as those of a check, and begin again with an empty bag."""
        taken, self._taken, self._room = self._taken, [], _ROOM
        return [
            BagMessage(
                grade_id=grade_id, topic=topic, type=name, stamp=stamp, data=base64.b64encode(data).decode("ascii")
            )
            for topic, name, stamp, data in taken
        ]


_MESSAGE_OVERHEAD = 1024
"""The bytes that a message takes in addition to its data, approximately."""
_AT_ONCE = 50
"""The number of messages that are taken from one topic before it is the turn of the others."""


class Recorder(Protocol):
    """The object that records, which is an observer."""

    node: Node
    bag: Bag
    """The bag that keeps what is received."""

    def room_for(self, size: int, kept: int) -> bool:
        """Reserve room for a message of `size` bytes in a recording that keeps `kept` bytes; False if there is none."""

    def notify(self) -> None:
        """Wake all threads that wait, because something has happened."""

    def wait(self, ready: Callable[[], object], within: float) -> bool:
        """Wait until `ready()` is true; at most `within` seconds."""


def quiet_profile() -> QoSProfile:
    """Return a profile that is compatible with every publisher: best effort and volatile.

    Its queue is deep enough for a grader that stalls for a while.
    """
    return QoSProfile(
        reliability=QoSReliabilityPolicy.BEST_EFFORT,
        durability=QoSDurabilityPolicy.VOLATILE,
        history=QoSHistoryPolicy.KEEP_LAST,
        depth=5000,
    )


@dataclass(frozen=True)
class Received:
    """One message and the middleware's information about it."""

    msg: Any
    received: float
    """When the observer took it, in seconds on the monotonic clock."""
    stamp: float
    """When it was published, in seconds on the publisher's system clock. Stamps of different topics can be compared,
    because all publishers run on the same machine."""
    sequence: int
    """The number of the message in the publisher's own count, from 1."""


class Recording:
    """All messages on a topic since the observer subscribed, in the order of arrival, while the observer has room."""

    def __init__(self, observer: Recorder, topic: str, msg_type: type, qos: QoSProfile) -> None:
        """Subscribe to the topic; use `Observer.record`, which shares recordings."""
        self.topic = topic
        self.msg_type = msg_type
        self.qos = qos
        self.incompatible: list[str] = []
        """The names of the QoS policies because of which a publisher did not match this subscription."""
        self.alive = 0
        """The number of publishers that count as alive. One that hangs is noticed only if the profile has a lease."""
        self._observer = observer
        self._messages: list[Received] = []
        self._kept = 0
        # Every publisher matches the quiet profile, and it has no lease, so no such event can occur.
        quiet = qos == quiet_profile()
        # The observer's thread may take a first message before `create_subscription` has returned in this thread.
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
        """Keep a message, and those that are queued behind it.

        An executor takes one message of each topic in turn. After a delay, it would lag behind on a topic with many
        messages, although it already has later messages of other topics.
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
        except Exception:  # a program can send data that is not a message of this type
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
        """A copy of the list of messages that have arrived so far, so that it does not grow during an iteration."""
        return list(self._messages)

    def messages_from(self, number: int) -> list[Received]:
        """Return the messages that have arrived so far, without the first `number`."""
        return self._messages[number:]

    @property
    def count(self) -> int:
        """The number of messages so far."""
        return len(self._messages)

    @property
    def matched(self) -> int:
        """The number of publishers whose QoS matches this subscription."""
        return int(self._subscription.get_publisher_count()) if self._subscription is not None else 0

    def wait_for(self, count: int, within: float = 10.0) -> bool:
        """Wait until at least `count` messages have arrived; at most `within` seconds."""
        return self._observer.wait(lambda: self.count >= count, within)
