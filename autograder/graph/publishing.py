"""Publishes messages from the observer: a steady stream of messages, and the simulated time on `/clock`."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

from rclpy.qos import QoSProfile
from rclpy.time import Time
from rosgraph_msgs.msg import Clock

from autograder.graph.observer import Observer


class Stream:
    """Publishes one message repeatedly between `start` and `stop`. The publisher stays after the first `start`."""

    def __init__(
        self,
        observer: Observer,
        topic: str,
        message: Any,
        rate: float,
        qos: QoSProfile,
        expect_heard: Callable[[Callable[[], int]], None],
    ) -> None:
        """Describe the stream, without creating anything on the graph yet.

        Args:
            observer: the observer whose node publishes.
            topic: the full name of the topic.
            message: the message that is sent.
            rate: the rate in hertz.
            qos: the QoS that the publisher offers. With manual liveliness, each message asserts it.
            expect_heard: called with a function that returns the number of matched subscriptions; waits until there is
                one and it knows the publisher, and otherwise fails.
        """
        self._observer, self._topic, self._message, self._qos = observer, topic, message, qos
        self._period = 1 / rate
        self._expect_heard = expect_heard
        self._publisher: Any = None
        self._timer: Any = None
        self._on = False
        self.last = 0.0
        """When the last message was sent, in seconds on the system clock, like message stamps. A busy machine sends it
        long before `stop` is called."""

    def start(self) -> None:
        """Start or resume sending. If no subscription matches, this is recorded as a failed outcome."""
        if self._publisher is None:
            self._publisher = self._observer.publisher(self._topic, type(self._message), self._qos)
        self._expect_heard(self._publisher.get_subscription_count)
        self._on = True
        if self._timer is None:
            self._timer = self._observer.node.create_timer(self._period, self._send)

    def stop(self) -> None:
        """Stop sending, but keep the publisher, so that it looks like that of a program that hangs."""
        # The timer is not canceled: if it is just due, the executor's thread would still call it, and rclpy's
        # `_take_timer` lets the error of a canceled timer end the spinning.
        self._on = False

    def assert_liveliness(self) -> None:
        """Assert the liveliness of the publisher without a message, as a node does that has nothing to say.

        With manual liveliness, a best-effort subscription is not told (seen with Fast DDS: the assertion is part of a
        heartbeat, which only reliable subscriptions get).
        """
        self._publisher.assert_liveliness()

    def _send(self) -> None:
        if self._on:
            self.last = time.time()
            self._publisher.publish(self._message)


REPEAT = 0.1
"""The seconds after which a stamp without effect is sent again, because it may have been lost before the node was
matched."""


class ClockDriver:
    """Publishes `/clock`, but only on request. In between, the time in the launch stands still."""

    def __init__(self, observer: Observer) -> None:
        """Start at 1 s, because rclpy treats time 0 as "not set"."""
        self._observer = observer
        self._publisher = observer.publisher("/clock", Clock, 10)
        self.now = 1.0
        """The simulated time in seconds."""

    def advance(self, step: float, effect: Callable[[], bool], within: float = 5.0) -> bool:
        """Advance the time by `step` seconds and wait for the effect. The stamp is repeated until the effect occurs.

        A free-running clock loses ticks on a busy machine. With this lock-step clock, every run has the same ticks.
        """
        self.now += step
        stamp = Clock(clock=Time(nanoseconds=round(self.now * 1e9)).to_msg())
        for _ in range(max(1, round(within / REPEAT))):
            self._publisher.publish(stamp)
            if self._observer.wait(effect, REPEAT):
                return True
        return False
