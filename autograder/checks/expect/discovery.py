"""Waits until the observer and the nodes have discovered each other, so that what is sent arrives and is answered."""

from __future__ import annotations

from collections.abc import Callable, Collection

from rclpy.topic_endpoint_info import TopicEndpointInfo

from autograder.checks.expect.expectations import Noun
from autograder.checks.settling import shows_all
from autograder.diagnosis.inside import read
from autograder.graph.names import UNKNOWN_NODE, node_of
from autograder.graph.services import ask_nodes
from autograder.sandbox.inside.probe.events import Event, NodeSeen, ProbeFailed

_ANSWERS_WITHIN = 3.0
"""Seconds in which a node answers that spins: callbacks of a second may run before it gets to the question."""
MATCHES_WITHIN = 1.0
"""Seconds to wait for the check's recordings before it sends something that may be answered at once."""

NAMED_WITHIN = 10.0
"""Seconds that the word of which node an endpoint belongs to may be under way; what is lost is sent again after 3."""

_ASKED = 16
"""So many nodes are asked at the most: a program may make any number of them."""


class Discovery(Noun):
    """The discovery between the nodes and the observer."""

    def _settle(self, names: Collection[str]) -> None:
        """Wait for proof that nodes which were just made also live on: an answer from each of them.

        A program that fails a few lines after it made its node shows the node for a moment. Whether the observer sees
        that moment is chance, and a verdict must not depend on it. A node that nobody spins cannot answer; for it a
        while without an end of the program has to do.

        The answer also says that the node knows all ends that the observer had when it asked: a program learns of
        them in the order in which they were made, and the question's own end is the last.
        """
        self._running.met.update(dict.fromkeys(names, len(self._observer.recordings())))
        ask_nodes(self._observer, names, _ANSWERS_WITHIN, self._has_failed)

    def _has_failed(self) -> bool:
        """Whether a program has ended that had to go on, so that the launch has failed whatever the others answer."""
        return self._running.gone_program() is not None

    def _settle_owners(self, ends: Callable[[], list[TopicEndpointInfo]], *, again: bool = True) -> None:
        """Wait for an answer from each node that has one of these ends.

        Args:
            ends: returns the ends.
            again: whether nodes are also asked that have been asked before.
        """
        # An endpoint comes to be on the graph before the name of its node does.
        self._observer.wait(
            lambda: all(end.node_name != UNKNOWN_NODE for end in ends()), NAMED_WITHIN, self._has_failed
        )
        owners = {node_of(end) for end in ends() if end.node_name != UNKNOWN_NODE}
        self._settle(owners - self._running.gone_nodes() - (set() if again else self._running.met.keys()))

    def _meet(self, ready: Callable[[], object], within: float) -> None:
        """Wait until everything is heard that is set off by what the check sends next.

        Each end is discovered by itself, and by each side by itself: an observer that has found a subscription may
        not have found the same node's publisher yet, and a publisher that is found may not have found the observer.
        Then the first message is lost. That the node knows the observer only the node can say, so it is asked; its
        answer also says that it has come to spinning, and has made what it makes before that.

        Args:
            ready: whether that is on the graph which is sent to.
            within: seconds until it must be there; what is missing is left to whoever sends.
        """
        recorded, started = len(self._observer.recordings()), len(self._running.programs)
        if not recorded or not self._wait_for_graph(ready, within):
            return
        if self._running.introduced == (recorded, started):
            self._observer.wait(self._observer.hears_all, MATCHES_WITHIN)
            return
        complete = self._all_begun()
        for _ in range(2):  # an answer may come from a program that has made more nodes before it
            self._observer.wait(self._hears_programs, MATCHES_WITHIN)
            strangers = {name for name in self._observer.nodes() if self._running.met.get(name, 0) < recorded}
            self._settle(sorted(strangers - self._running.gone_nodes())[:_ASKED])
        if complete:  # a program that comes up later is asked before what is sent then
            self._running.introduced = (recorded, started)

    def _hears_programs(self) -> bool:
        """Whether the observer has found, and hears, everything that the programs say they have created."""
        return self._observer.hears_all() and all(shows_all(self._observer, told) for told in self._told())

    def _all_begun(self) -> bool:
        """Whether each program has made a node, as far as its probe can tell."""
        return all(any(isinstance(event, NodeSeen | ProbeFailed) for event in told) for told in self._told())

    def _made(self, name: str) -> int:
        """How many nodes of this name the programs have said they made."""
        made = (event for told in self._told() for event in told if isinstance(event, NodeSeen))
        return sum(event.name == name and not event.destroyed for event in made)

    def _told(self) -> list[list[Event]]:
        """The events of the probe of each running program."""
        return [read(program.events()) for _, program in self._running.programs if program.running()]
