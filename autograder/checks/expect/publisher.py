"""`ros.publisher`: messages from the check to the student's nodes."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from rclpy.qos import QoSProfile, ReliabilityPolicy

from autograder import diagnosis
from autograder.checks.expect.discovery import Discovery
from autograder.checks.expect.expectations import WITHIN
from autograder.checks.misuse import refuse_other_class
from autograder.checks.running_launch import RunningLaunch
from autograder.checks.scoring import asked
from autograder.checks.waiting import waits_for
from autograder.graph.publishing import Stream

RELIABLE_DEEP = 1000
"""Depth of the check's own publishers, so that a burst of its own is never cut."""


class Publisher(Discovery):
    """A publisher of the check's own, which sends to the student's nodes."""

    def __init__(
        self, running: RunningLaunch, topic: str, msg_type: type, qos: QoSProfile | int = RELIABLE_DEEP
    ) -> None:
        """Describe the publisher; it is made when it is first used."""
        super().__init__(running, topic)
        refuse_other_class(f'ros.publisher("{topic}")', msg_type, "message")
        self._type = msg_type
        self._qos = qos if isinstance(qos, QoSProfile) else QoSProfile(depth=qos)

    def open(self) -> Any:
        """Make one more publisher now: the one that a later `publish` uses, before the program subscribes.

        A best-effort subscription hears only what comes after it has matched, and only the program can tell when that
        is: one that is made after the publisher has matched it by the time its other messages arrive.

        Returns:
            rclpy's publisher.

        Example:
            `ros.publisher("/chatter", String, qos=profile).open()`
        """
        made = self._observer.publisher(self.name, self._type, self._qos)
        self._running.publishers[self._key] = made
        return made

    @property
    def _key(self) -> tuple[str, str]:
        return self.name, str(self._qos)  # its repr would tell objects apart, not policies

    @waits_for("a subscription on `{name}`")
    def publish(self, *messages: Any, within: float = WITHIN, hint: str = "") -> None:
        """Send messages to the student's node, once its subscription has matched.

        What the messages set off is heard from the first one on if its topic is recorded: `listen` before.
        A missing or incompatible subscription is a failed outcome with its reason.

        Args:
            messages: one or more.
            within: seconds until a subscription must have matched.
            hint: a pointer for the student.

        Example:
            `ros.publisher("/chatter", String).publish(String(data="hello"))`

        Codes:
            those of `expect_subscription` and `qos-reliability` and so on, by the policy that does not match.
        """
        publisher = self._running.publishers.get(self._key) or self.open()
        self._wait_until_heard(publisher.get_subscription_count, within, hint)
        if publisher not in self._running.known_publishers:
            self._running.known_publishers.append(publisher)
            ends = self._observer.subscriptions(self.name)
            if any(end.qos_profile.reliability == ReliabilityPolicy.BEST_EFFORT for end in ends):
                self._make_known()
        self._meet(publisher.get_subscription_count, within)
        asked(self.name)
        for message in messages:
            publisher.publish(message)

    def stream(self, message: Any, *, rate: float) -> Stream:
        """A message that is sent again and again, as by a sensor or a controller, between `start()` and `stop()`.

        A node of the student's must subscribe to the topic with a profile that matches.

        Args:
            message: what is sent.
            rate: hertz.

        Example:
            `sensor = ros.publisher("/range", Range, qos=profile).stream(Range(range=1.0), rate=20)`

        Codes:
            those of `publish`, at `start()`.
        """

        def expect_heard(matched: Callable[[], int]) -> None:
            self._wait_until_heard(matched, WITHIN, "")
            self._make_known()

        return Stream(self._observer, self.name, message, rate, self._qos, expect_heard)

    def _wait_until_heard(self, matched: Callable[[], int], within: float, hint: str) -> None:
        """Wait until a subscription has matched a publisher of the observer's; fail with what keeps them apart."""
        if self._wait_for_graph(matched, within):
            return
        topic = self.name
        mismatch = diagnosis.why_not_matched(self._scene(), topic, self._qos, "subscription")
        self._fail(
            f"A node listens to `{topic}`" if mismatch is None else f"What is sent on `{topic}` reaches a subscription",
            mismatch or diagnosis.why_no_endpoint(self._scene(), topic, self._type, "subscription"),
            expected=f"a subscription on {topic}" + " that matches" * (mismatch is not None),
            observed=self._topics() if mismatch is None else "a subscription whose QoS does not match",
            hint=hint,
        )

    def _make_known(self) -> None:
        """Wait until the nodes that subscribe to the topic know the check's publisher, which knows them already.

        What is sent before that never reaches a best-effort subscription, and only the other side can tell. It tells
        by answering a question: a program learns of the check's ends in the order in which they were made, and the
        question's own end is the last.
        """
        self._settle_owners(lambda: self._observer.subscriptions(self.name))
