"""What the observer publishes itself: a steady stream of messages, and the simulated time on `/clock`."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from rclpy.qos import QoSProfile
from rclpy.time import Time
from rosgraph_msgs.msg import Clock

from autograder.graph.observer import Observer


class Stream:
    """Publishes one message again and again between `start` and `stop`; once it is there, the publisher stays."""

    def __init__(
        self,
        observer: Observer,
        topic: str,
        message: Any,
        rate: float,
        qos: QoSProfile,
        expect_heard: Callable[[Callable[[], int]], None],
    ) -> None:
        """Describe the stream; nothing is on the graph yet.

        Args:
            observer: whose node publishes.
            topic: full name.
            message: what is sent.
            rate: hertz.
            qos: what the publisher offers. With manual liveliness each message asserts it.
            expect_heard: waits until the number of matched subscriptions, which it is given, is not 0 and these know
                the publisher, or fails.
        """
        self._observer, self._topic, self._message, self._qos = observer, topic, message, qos
        self._period = 1 / rate
        self._expect_heard = expect_heard
        self._publisher: Any = None
        self._timer: Any = None

    def start(self) -> None:
        """Send, or send again; a subscription that is missing or does not match is a failed outcome."""
        if self._publisher is None:
            self._publisher = self._observer.publisher(self._topic, type(self._message), self._qos)
        self._expect_heard(self._publisher.get_subscription_count)
        if self._timer is None:
            self._timer = self._observer.node.create_timer(self._period, lambda: self._publisher.publish(self._message))
        elif self._timer.is_canceled():
            self._timer.reset()

    def stop(self) -> None:
        """Stop sending: from outside it looks like a program that hangs."""
        if self._timer is not None:
            self._timer.cancel()


REPEAT = 0.1
"""Seconds after which an unanswered stamp is sent again: it may have been lost before the node was matched."""


class ClockDriver:
    """Publishes `/clock`, only when told to: time in the launch stands still in between."""

    def __init__(self, observer: Observer) -> None:
        """Start at 1 s: rclpy takes time 0 for "not set"."""
        self._observer = observer
        self._publisher = observer.publisher("/clock", Clock, 10)
        self.now = 1.0
        """Simulated seconds."""

    def advance(self, step: float, effect: Callable[[], bool], within: float = 5.0) -> bool:
        """Move time on by `step` seconds and wait for its effect; the stamp is repeated until the effect shows.

        A clock that runs freely loses ticks on a busy machine; in lock-step each run has the same ticks.
        """
        self.now += step
        stamp = Clock(clock=Time(nanoseconds=round(self.now * 1e9)).to_msg())
        for _ in range(max(1, round(within / REPEAT))):
            self._publisher.publish(stamp)
            if self._observer.wait(effect, REPEAT):
                return True
        return False
