"""A lifecycle node's states and transitions, asked for through its services and heard on its event topic.

Transitions are requested by label only, and only those the node offers at that moment: a request with an id that is
not available in the current state ends a healthy rclpy node (rclpy 7.1), a label never does.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from lifecycle_msgs.msg import Transition, TransitionEvent
from lifecycle_msgs.srv import ChangeState, GetAvailableTransitions, GetState
from rclpy.qos import QoSProfile, QoSReliabilityPolicy

from autograder.graph.observer import Observer
from autograder.graph.parameters import NoAnswer
from autograder.graph.services import ServiceMissing

GiveUp = Callable[[], bool]

MATCH_SECONDS = 1.0
"""How long a transition waits for the event topic to be matched: its events are volatile, late listeners miss them."""


@dataclass(frozen=True)
class Change:
    """One step of a node's state machine, as its `transition_event` told it."""

    node: str
    start: str
    goal: str
    stamp: float
    """When the node published it, seconds on its system clock; comparable between nodes of one machine."""

    @property
    def step(self) -> tuple[str, str]:
        """Labels of the state it left and the state it entered."""
        return self.start, self.goal


@dataclass(frozen=True)
class Requested:
    """What became of one requested transition."""

    label: str
    before: str
    """State in which it was requested."""
    after: str
    """State the node reported afterwards."""
    available: tuple[str, ...]
    """Labels the node offered in the state `before`."""
    success: bool
    """What the node answered; False as well if it did not offer the transition, which then was not sent."""

    @property
    def offered(self) -> bool:
        """Whether the node's state machine has this transition in the state `before`."""
        return self.label in self.available


class LifecycleClient:
    """Asks and drives one lifecycle node, and keeps its state changes from the moment this object exists.

    Make it before the node starts: `transition_event` is volatile, and whoever subscribes later misses what was.
    """

    def __init__(self, observer: Observer, node: str) -> None:
        """Subscribe to the events and make the clients; does not wait.

        Args:
            observer: who asks; its own thread spins it.
            node: full node name.
        """
        self.node = node
        self._observer = observer
        self._events = observer.record(
            f"{node}/transition_event",
            TransitionEvent,
            QoSProfile(depth=1000, reliability=QoSReliabilityPolicy.RELIABLE),
        )
        self._clients = {
            srv_type: observer.node.create_client(srv_type, f"{node}/{name}")
            for srv_type, name in (
                (GetState, "get_state"),
                (GetAvailableTransitions, "get_available_transitions"),
                (ChangeState, "change_state"),
            )
        }

    def close(self) -> None:
        """Destroy the clients; the recorded events stay."""
        for client in self._clients.values():
            self._observer.node.destroy_client(client)
        self._clients.clear()

    @property
    def changes(self) -> list[Change]:
        """All state changes heard so far, in the order they were published."""
        heard = [
            Change(self.node, item.msg.start_state.label, item.msg.goal_state.label, item.stamp)
            for item in self._events.messages
        ]
        return sorted(heard, key=lambda change: change.stamp)

    def state(self, within: float = 10.0, give_up: GiveUp = lambda: False) -> str:
        """Label of the current state.

        Args:
            within: seconds, once for the service to appear and once for the answer.
            give_up: says that no answer can come any more, for example because the program ended.

        Raises:
            ServiceMissing: there is no such lifecycle node.
            NoAnswer: it did not answer in time: nothing spins it, or a callback of its never returned.
        """
        return str(self._ask(GetState, GetState.Request(), within, give_up).current_state.label)

    def available(self, within: float = 10.0, give_up: GiveUp = lambda: False) -> Mapping[str, str]:
        """The transitions the node offers now: label of each, and the label of its goal state.

        No state offers two transitions of one label: the three shutdowns leave three states. Raises as `state`.
        """
        offered = self._offered(within, give_up)
        return {item.transition.label: item.goal_state.label for item in offered}

    def transition(self, label: str, within: float = 10.0, give_up: GiveUp = lambda: False) -> Requested:
        """Request a transition by its label, wait for the answer and ask for the state after it.

        Args:
            label: `configure`, `activate`, `deactivate`, `cleanup` or `shutdown`.
            within: seconds for each question.
            give_up: as for `state`.

        Raises:
            ServiceMissing: there is no such lifecycle node.
            NoAnswer: no answer, and the node does not tell its state any more either.
        """
        transitions = self._offered(within, give_up)
        # Each names the state it starts from; only a finalized node offers none.
        before = str(transitions[0].start_state.label) if transitions else self.state(within, give_up)
        offered = tuple(str(item.transition.label) for item in transitions)
        if label not in offered:
            return Requested(label, before, before, offered, success=False)
        self._observer.wait(lambda: self._events.matched > 0, MATCH_SECONDS, give_up)
        request = ChangeState.Request(transition=Transition(label=label))
        response = self._send(ChangeState, request, within, give_up)
        after = self.state(within, give_up)
        if response is None and after == before:
            # The very first request can get lost while both sides are being matched. The node answers and has not
            # moved, so a second request cannot do the transition twice.
            response = self._send(ChangeState, request, within, give_up)
            after = self.state(within, give_up)
        if response is None:
            raise NoAnswer(self.node)
        return Requested(label, before, after, offered, success=bool(response.success))

    def wait_for_state(self, label: str, within: float = 10.0, give_up: GiveUp = lambda: False) -> str:
        """Wait until the node is in a state; the label of its state then, or when the time was over. Raises as `state`.

        The events tell when asking can help, so that a waiting observer does not flood the node. While they go on the
        wait does so too, for twice as long at the most.
        """
        until = time.monotonic() + 2 * within
        while True:
            heard = self._events.count
            seen = self.state(within, give_up)
            if seen == label or time.monotonic() >= until or not self._wait_for_more(heard, within, give_up):
                return seen

    def wait_for_changes(self, count: int, within: float = 10.0, give_up: GiveUp = lambda: False) -> list[Change]:
        """Wait until `count` state changes were heard, at most `within` seconds; all that were heard by then."""
        self._observer.wait(lambda: self._events.count >= count, within, give_up)
        return self.changes

    def _wait_for_more(self, heard: int, within: float, give_up: GiveUp) -> bool:
        return self._observer.wait(lambda: self._events.count > heard, within, give_up)

    def _offered(self, within: float, give_up: GiveUp) -> list[Any]:
        reply = self._ask(GetAvailableTransitions, GetAvailableTransitions.Request(), within, give_up)
        return list(reply.available_transitions)

    def _ask(self, srv_type: type, request: Any, within: float, give_up: GiveUp) -> Any:
        # Questions change nothing, so a lost first request may be repeated.
        for _ in range(2):
            response = self._send(srv_type, request, within / 2, give_up)
            if response is not None:
                return response
            if give_up():
                break
        raise NoAnswer(self.node)

    def _send(self, srv_type: type, request: Any, within: float, give_up: GiveUp) -> Any | None:
        client = self._clients[srv_type]
        if not self._observer.wait(client.service_is_ready, within, give_up):
            raise ServiceMissing(client.srv_name)
        future = client.call_async(request)
        future.add_done_callback(lambda _: self._observer.notify())
        self._observer.wait(future.done, within, give_up)
        if not future.done():
            client.remove_pending_request(future)
            return None
        return future.result()


def in_order(clients: Iterable[LifecycleClient]) -> list[Change]:
    """State changes of several nodes in the order in which they were published."""
    return sorted((change for client in clients for change in client.changes), key=lambda change: change.stamp)
