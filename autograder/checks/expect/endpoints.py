"""Expectations of the ends of topics: publishers and subscriptions, whose they are, and from whom messages come."""

from __future__ import annotations

import itertools
from collections import Counter
from collections.abc import Sequence
from typing import Literal

from rclpy.topic_endpoint_info import TopicEndpointInfo

from autograder import diagnosis
from autograder.checks import outcomes
from autograder.checks.expect.discovery import NAMED_WITHIN, Discovery
from autograder.checks.settling import shows_all
from autograder.diagnosis.names import WRONG_NODE
from autograder.graph.names import UNKNOWN_NODE, node_of, type_name
from autograder.graph.recording import Received
from autograder.reasons import Group, Kind
from autograder.sandbox.inside.probe.events import Thing

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


class Ends(Discovery):
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


_MADE_WITHIN = 2.0
"""Seconds in which what the programs say they made comes to be on the graph."""
_NAMELESS = "a node whose name is not known"


class Sources(Ends):
    """What expectations of messages ask of their publishers."""

    def _one_source(
        self, title: str, topic: str, msg_type: type, node: str, publishers: int, received: Sequence[Received]
    ) -> None:
        """Fail if the messages may come from another publisher than the one that is meant."""
        if not received:
            return
        self._observer.wait(lambda: shows_all(self._observer, self._publishers_made(topic)), _MADE_WITHIN)
        self._observer.wait(lambda: _NAMELESS not in self._nodes_publishing(topic, msg_type), NAMED_WITHIN)
        owners = self._nodes_publishing(topic, msg_type)
        named = ", ".join(f"{many} of {name}" if many > 1 else name for name, many in sorted(Counter(owners).items()))
        if len(owners) > publishers and not (
            len(set(owners)) == publishers == 1 and not self._several_used(topic, received)
        ):
            self._fail(
                title,
                EXTRA_PUBLISHER(
                    f"`{topic}` has {len(owners)} publishers ({named}), so the check cannot tell which of them sent"
                    " these messages.",
                    "Publish on this topic from one place only."
                    + " Create the publisher once, in the constructor, and send each message with it."
                    * (len(set(owners)) == 1),
                ),
                expected=f"{publishers} publisher",
                observed=f"{len(owners)} publishers",
            )
        if publishers == 1 and _numbers_repeat(received):
            because = f"The messages on `{topic}` come from more than one publisher (their sequence numbers repeat)."
            self._fail(title, EXTRA_PUBLISHER(because), expected="one publisher")
        if node and node not in owners:
            named = named or "nobody any more"
            because = f"The messages on `{topic}` come from {named}, not from `{node}`."
            self._fail(title, WRONG_NODE(because), expected=node, observed=named)

    def _nodes_publishing(self, topic: str, msg_type: type) -> list[str]:
        """The full name of each publisher's node."""
        return [
            node_of(end) if end.node_name != UNKNOWN_NODE else _NAMELESS
            for end in self._ends(topic, msg_type, "publisher", "")
        ]

    def _several_used(self, topic: str, received: Sequence[Received]) -> bool:
        """Whether more than one publisher of a topic has sent something."""
        return _numbers_repeat(received) or sum(thing.runs > 0 for thing in self._publishers_made(topic)) > 1

    def _publishers_made(self, topic: str) -> list[Thing]:
        """The publishers of a topic that the programs which run say they made."""
        return [
            event
            for told in self._told()
            for event in told
            if isinstance(event, Thing) and event.kind == "publisher" and event.name == topic and not event.destroyed
        ]


def _numbers_repeat(received: Sequence[Received]) -> bool:
    """Each publisher counts its own messages: a second one, gone by now, shows as a number that comes again."""
    return any(later.sequence <= earlier.sequence for earlier, later in itertools.pairwise(received))
