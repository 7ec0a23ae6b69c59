"""Whose messages arrive: from one publisher, and from the node that is meant."""

from __future__ import annotations

import itertools
from collections import Counter
from collections.abc import Sequence

from autograder.checks.expect.endpoints import EXTRA_PUBLISHER, Ends
from autograder.checks.settling import shows_all
from autograder.diagnosis.names import WRONG_NODE
from autograder.graph.names import UNKNOWN_NODE, node_of
from autograder.graph.recording import Received
from autograder.sandbox.inside.probe.events import Thing

_MADE_WITHIN = 2.0
"""Seconds in which what the programs say they made comes to be on the graph."""
_NAMED_WITHIN = 10.0
"""Seconds that the word of which node an endpoint belongs to may be under way; what is lost is sent again after 3."""
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
        self._observer.wait(lambda: _NAMELESS not in self._nodes_publishing(topic, msg_type), _NAMED_WITHIN)
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
