"""Expectations of the ends of topics: publishers and subscriptions, and whose they are."""

from __future__ import annotations

from collections import Counter
from typing import Literal

from rclpy.topic_endpoint_info import TopicEndpointInfo

from autograder import diagnosis
from autograder.checks import outcomes
from autograder.checks.expect.meeting import Meeting
from autograder.graph.names import node_of, type_name
from autograder.reasons import Group, Kind

COUNT = Kind("count", "a topic does not have the required number of publishers or subscriptions", Group.ENDS)
PUBLISHER_PRESENT = Kind("publisher-present", "a publisher is still on a topic that should have none", Group.ENDS)
SUBSCRIPTION_PRESENT = Kind(
    "subscription-present", "a subscription is still on a topic that should have none", Group.ENDS
)
EXTRA_PUBLISHER = Kind(
    "extra-publisher",
    "more nodes publish than may, or the messages of one topic carry several senders' numbers",
    Group.ENDS,
)

End = Literal["publisher", "subscription"]
_PRESENT: dict[End, Kind] = {"publisher": PUBLISHER_PRESENT, "subscription": SUBSCRIPTION_PRESENT}


class Ends(Meeting):
    """What ends a topic must have, and what not."""

    def _ends(self, topic: str, msg_type: type | None, kind: End, node: str) -> list[TopicEndpointInfo]:
        ends = self._observer.publishers(topic) if kind == "publisher" else self._observer.subscriptions(topic)
        return [
            end
            for end in ends
            if (msg_type is None or end.topic_type == type_name(msg_type)) and (not node or node_of(end) == node)
        ]

    def _expect_end(
        self, topic: str, msg_type: type, kind: End, node: str, count: int, within: float, hint: str
    ) -> None:
        wanted = f"{'' if kind == 'publisher' else 'at least '}{count} {kind}s" if count != 1 else f"a {kind}"
        whose = f"`{node}`" if node else "A node" if count == 1 else "The topic"
        title = f"{whose} has {wanted} on `{topic}` ({type_name(msg_type)})"

        def number() -> int:
            return len(self._ends(topic, msg_type, kind, node))

        found = self._wait_for_graph(lambda: number() >= count, within)
        # A node that listens in two places of its own does what was asked; two publishers may be two senders.
        if found and (kind == "subscription" or number() == count):
            outcomes.passed(title, observed=topic)
            return
        those = f"{number()} {kind}{'s' * (number() != 1)}"
        owners = self._owners(topic, kind, msg_type, node)
        reason = COUNT(f"`{topic}` has {those}, not {count}: {owners}.")
        if found:
            reason = EXTRA_PUBLISHER(reason.because)
        elif not number():
            reason = diagnosis.why_no_endpoint(self._scene(), topic, msg_type, kind, node)
        self._fail(
            title,
            reason,
            expected=f"{wanted} on {topic} ({type_name(msg_type)})",
            observed=f"{those}: {owners}" if owners else f"none; topics: {self._topics()}",
            hint=hint,
        )

    def _owners(self, topic: str, kind: End, msg_type: type | None = None, node: str = "") -> str:
        """Whose ends of this kind are on the topic, with their number where a node has several."""
        owners = Counter(node_of(end) for end in self._ends(topic, msg_type, kind, node))
        return ", ".join(owner if times == 1 else f"{owner} ({times})" for owner, times in sorted(owners.items()))

    def _expect_no_end(self, topic: str, kind: End, within: float, hint: str) -> None:
        gone = self._observer.wait(lambda: not self._ends(topic, None, kind, ""), within)
        self._expect_that(
            gone,
            f"`{topic}` has no {kind}",
            lambda: _PRESENT[kind](f"A {kind} on `{topic}` is still there, of {self._owners(topic, kind)}."),
            hint=hint,
        )
