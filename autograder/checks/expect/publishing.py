"""Sending: messages from the check to the student's nodes."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from typing import Any

from rclpy.qos import QoSProfile, ReliabilityPolicy

from autograder import diagnosis
from autograder.checks.expect.endpoints import EndExpectations
from autograder.checks.expect.expectations import WITHIN
from autograder.checks.parts import asked
from autograder.graph.names import node_of
from autograder.graph.publishing import Stream

RELIABLE_DEEP = 1000
"""Depth of the check's own publishers, so that a burst of its own is never cut."""


class Publishing(EndExpectations):
    """What the check sends."""

    @cached_property
    def _publishers(self) -> dict[tuple[str, str], Any]:
        return {}

    @cached_property
    def _known(self) -> list[Any]:
        """Publishers that have been used: what subscribed by then knows them."""
        return []

    def open_publisher(self, topic: str, msg_type: type, *, qos: QoSProfile | int = RELIABLE_DEEP) -> Any:
        """Make one more publisher: the one that a later `publish` uses, before the program subscribes.

        A best-effort subscription hears only what comes after it has matched, and only the program can tell when that
        is: one that is made after the publisher has matched it by the time its other messages arrive.

        Args:
            topic: full name.
            msg_type: message class.
            qos: what is offered, a profile or a depth.

        Example:
            `ros.open_publisher("/chatter", String, qos=profile)`
        """
        profile = qos if isinstance(qos, QoSProfile) else QoSProfile(depth=qos)
        publisher = self._observer.publisher(topic, msg_type, profile)
        self._publishers[_key(topic, profile)] = publisher
        return publisher

    def publish(
        self,
        topic: str,
        *messages: Any,
        qos: QoSProfile | int = RELIABLE_DEEP,
        within: float = WITHIN,
        hint: str = "",
    ) -> None:
        """Send messages to the student's node, once its subscription has matched.

        What the messages set off is heard from the first one on if its topic is recorded: `listen` before.
        A missing or incompatible subscription is a failed outcome with its reason.

        Args:
            topic: full name.
            messages: one or more, of one class.
            qos: what is offered, a profile or a depth.
            within: seconds until a subscription must have matched.
            hint: a pointer for the student.

        Example:
            `ros.publish("/chatter", String(data="hello"))`

        Codes:
            those of `expect_subscription` and `qos-reliability` and so on, by the policy that does not match.
        """
        msg_type = type(messages[0])
        profile = qos if isinstance(qos, QoSProfile) else QoSProfile(depth=qos)
        publisher = self._publishers.get(_key(topic, profile)) or self.open_publisher(topic, msg_type, qos=profile)
        self._wait_until_heard(publisher.get_subscription_count, topic, msg_type, profile, within, hint)
        if publisher not in self._known:
            self._known.append(publisher)
            ends = self._observer.subscriptions(topic)
            if any(end.qos_profile.reliability == ReliabilityPolicy.BEST_EFFORT for end in ends):
                self._make_known(topic)
        self._meet(publisher.get_subscription_count, within)
        asked(topic)
        for message in messages:
            publisher.publish(message)

    def _wait_until_heard(
        self, matched: Callable[[], int], topic: str, msg_type: type, profile: QoSProfile, within: float, hint: str
    ) -> None:
        """Wait until a subscription has matched a publisher of the observer's; fail with what keeps them apart."""
        if self.wait_for_graph(matched, within):
            return
        mismatch = diagnosis.why_not_matched(self._scene(), topic, profile, "subscription")
        self._fail(
            f"A node listens to `{topic}`" if mismatch is None else f"What is sent on `{topic}` reaches a subscription",
            mismatch or diagnosis.why_no_endpoint(self._scene(), topic, msg_type, "subscription"),
            expected=f"a subscription on {topic}" + " that matches" * (mismatch is not None),
            observed=self._topics() if mismatch is None else "a subscription whose QoS does not match",
            hint=hint,
        )

    def _make_known(self, topic: str) -> None:
        """Wait until the nodes that subscribe to a topic know the check's publisher, which knows them already.

        What is sent before that never reaches a best-effort subscription, and only the other side can tell. It tells
        by answering a question: a program learns of the check's ends in the order in which they were made, and the
        question's own end is the last.
        """
        for owner in {node_of(end) for end in self._observer.subscriptions(topic)}:
            self._settle(owner)

    def stream(self, topic: str, message: Any, *, rate: float, qos: QoSProfile) -> Stream:
        """A message that is sent again and again, as by a sensor or a controller, between `start()` and `stop()`.

        Args:
            topic: full name; a node of the student's must subscribe to it with a profile that matches.
            message: what is sent.
            rate: hertz.
            qos: what is offered.

        Example:
            `sensor = ros.stream("/range", Range(range=1.0), rate=20, qos=profile)`

        Codes:
            those of `publish`, at `start()`.
        """

        def expect_heard(matched: Callable[[], int]) -> None:
            self._wait_until_heard(matched, topic, type(message), qos, WITHIN, "")
            self._make_known(topic)

        return Stream(self._observer, topic, message, rate, qos, expect_heard)


def _key(topic: str, profile: QoSProfile) -> tuple[str, str]:
    return topic, str(profile)  # its repr would tell objects apart, not policies
