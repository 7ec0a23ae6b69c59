"""A lifecycle node's states and transitions, requested through its services and recorded from its event topic.

Transitions are requested by label only, and only if the node offers them at that moment. A request with an ID that is
not available in the current state ends a healthy rclpy node (rclpy 7.1), but a request with a label never does.
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
"""How long a request waits until the event topic is matched: events are volatile, so late subscriptions miss them."""


@dataclass(frozen=True)
class Change:
    """One step of a node's state machine, as reported on its `transition_event` topic."""

    node: str
    start: str
    goal: str
    stamp: float
    """When the node published it, in seconds on its system clock; comparable between nodes on one machine."""

    @property
    def step(self) -> tuple[str, str]:
        """The labels of the state that the node left and of the state that it entered."""
        return self.start, self.goal


@dataclass(frozen=True)
class Requested:
    """The outcome of one requested transition."""

    label: str
    before: str
    """The state in which it was requested."""
    after: str
    """The state that the node reported afterwards."""
    available: tuple[str, ...]
    """The labels of the transitions that the node offered in the state `before`."""
    success: bool
    """What the node responded; also False if the node did not offer the transition, so that no request was sent."""

    @property
    def offered(self) -> bool:
        """Whether the node's state machine has this transition in the state `before`."""
        return self.label in self.available


class LifecycleClient:
    """Queries and controls one lifecycle node, and records its state changes from the moment this object exists.

    Create it before the node starts: `transition_event` is volatile, so a later subscription misses earlier events.
    """

    def __init__(self, observer: Observer, node: str) -> None:
        """Subscribe to the events and create the clients, without waiting.

        Args:
            observer: the observer that asks; its own thread spins it.
            node: the full name of the node.
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
        """All state changes received so far, in the order in which they were published."""
        heard = [
            Change(self.node, item.msg.start_state.label, item.msg.goal_state.label, item.stamp)
            for item in self._events.messages
        ]
        return sorted(heard, key=lambda change: change.stamp)

    def state(self, within: float = 10.0, give_up: GiveUp = lambda: False) -> str:
        """Return the label of the current state.

        Args:
            within: the seconds to wait, once for the service to appear and once for the response.
            give_up: returns true if no response can come any more, for example because the program has ended.

        Raises:
            ServiceMissing: there is no such lifecycle node.
            NoAnswer: the node did not answer in time, because nothing spins it or one of its callbacks never returned.
        """
        return str(self._ask(GetState, GetState.Request(), within, give_up).current_state.label)

    def available(self, within: float = 10.0, give_up: GiveUp = lambda: False) -> Mapping[str, str]:
        """Return the transitions that the node offers now: for the label of each, the label of its goal state.

        No state offers two transitions with the same label, because each of the three `shutdown` transitions starts
        from a different state. This raises the same exceptions as `state`.
        """
        offered = self._offered(within, give_up)
        return {item.transition.label: item.goal_state.label for item in offered}

    def transition(self, label: str, within: float = 10.0, give_up: GiveUp = lambda: False) -> Requested:
        """Request a transition by its label, wait for the answer and ask for the state after it.

        Args:
            label: `configure`, `activate`, `deactivate`, `cleanup` or `shutdown`.
            within: the seconds to wait for each response.
            give_up: as for `state`.

        Raises:
            ServiceMissing: there is no such lifecycle node.
            NoAnswer: the node did not answer the request, or does not answer when asked for its state.
        """
        transitions = self._offered(within, give_up)
        # Each transition names the state from which it starts; only a finalized node offers none.
        before = str(transitions[0].start_state.label) if transitions else self.state(within, give_up)
        offered = tuple(str(item.transition.label) for item in transitions)
        if label not in offered:
            return Requested(label, before, before, offered, success=False)
        self._observer.wait(lambda: self._events.matched > 0, MATCH_SECONDS, give_up)
        request = ChangeState.Request(transition=Transition(label=label))
        response = self._send(ChangeState, request, within, give_up)
        after = self.state(within, give_up)
        if response is None and after == before:
            # The very first request can get lost while both sides are being matched. The node answers and is still in
            # the same state, so a second request cannot cause the transition twice.
            response = self._send(ChangeState, request, within, give_up)
            after = self.state(within, give_up)
        if response is None:
            raise NoAnswer(self.node)
        return Requested(label, before, after, offered, success=bool(response.success))

    def wait_for_state(self, label: str, within: float = 10.0, give_up: GiveUp = lambda: False) -> str:
        """Wait until the node is in a state, and return the label of the state that it is in at the end of the wait.

        The node is asked again only after an event, so that a waiting observer does not flood it with requests. As long
        as events come, the wait continues, for at most twice as long. This raises the same exceptions as `state`.
        """
        until = time.monotonic() + 2 * within
        while True:
            heard = self._events.count
            seen = self.state(within, give_up)
            if seen == label or time.monotonic() >= until or not self._wait_for_more(heard, within, give_up):
                return seen

    def wait_for_changes(self, count: int, within: float = 10.0, give_up: GiveUp = lambda: False) -> list[Change]:
        """Wait until `count` state changes were received, at most `within` seconds, and return all of them."""
        self._observer.wait(lambda: self._events.count >= count, within, give_up)
        return self.changes

    def _wait_for_more(self, heard: int, within: float, give_up: GiveUp) -> bool:
        return self._observer.wait(lambda: self._events.count > heard, within, give_up)

    def _offered(self, within: float, give_up: GiveUp) -> list[Any]:
        reply = self._ask(GetAvailableTransitions, GetAvailableTransitions.Request(), within, give_up)
        return list(reply.available_transitions)

    def _ask(self, srv_type: type, request: Any, within: float, give_up: GiveUp) -> Any:
        # These requests change nothing, so one may be repeated if the first was lost.
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
    """Return the state changes of several nodes in the order in which they were published."""
    return sorted((change for client in clients for change in client.changes), key=lambda change: change.stamp)
