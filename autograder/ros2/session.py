"""The node that a verb looks and speaks through, and its view of the graph.

The real tool asks a daemon that has been on the graph for long. A verb of the kit joins the graph itself, and looks at
it when it has settled.
"""

from __future__ import annotations

import contextlib
import os
import re
import signal
import threading
import time
from collections.abc import Callable, Iterator
from functools import cached_property
from typing import Any, TypeVar

import rclpy
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.topic_endpoint_info import TopicEndpointInfo

from autograder.graph.names import UNKNOWN_NODE, full_name
from autograder.graph.observer import OBSERVER_NAME, Observer
from autograder.ros2.failure import TimeIsUp

PREFIX = "_ros2cli"
"""How the real tool's nodes begin: the underscore hides them."""

SPIN_TIME = 0.5
"""Seconds for which a verb listens at least before it believes what it sees, as the real tool without its daemon."""
_SETTLED_WITHIN = 3.3
"""Seconds after which the graph is taken as it is: the middleware repeats a lost packet of discovery after 3 s."""
_STILL = 0.1
"""Seconds between two looks that have to be alike."""
_POLL = 0.02

_Found = TypeVar("_Found")
_OWN = re.compile(rf"{OBSERVER_NAME}_[0-9a-f]{{6}}")


class Session:
    """One verb's stay on the graph. Joins at the first use; `close` leaves.

    Args:
        domain_id: ROS_DOMAIN_ID, or None for that of the environment.
        observer: has been on this graph for long: what it sees is all there is to see.
        seconds: after which the verb has to end, or None if only Ctrl-C ends it.
    """

    def __init__(self, domain_id: int | None, observer: Observer | None = None, seconds: float | None = None) -> None:
        """Prepare it."""
        self._domain_id = domain_id
        self._observer = observer
        self._ends = None if seconds is None else time.monotonic() + seconds
        self.options: Any = None
        """The verb's words, parsed."""
        self.name = f"{PREFIX}_{os.getpid()}"
        self._joined: tuple[Context, SingleThreadedExecutor] | None = None
        self._settled_at = 0.0

    @cached_property
    def node(self) -> Node:
        """The node that the verb speaks through."""
        context = Context()
        rclpy.init(context=context, domain_id=self._domain_id, args=[])
        sim_time = [Parameter("use_sim_time", value=True)] if getattr(self.options, "use_sim_time", False) else []
        node = rclpy.create_node(
            self.name,
            context=context,
            start_parameter_services=False,
            use_global_arguments=False,
            parameter_overrides=sim_time,
        )
        executor = SingleThreadedExecutor(context=context)
        executor.add_node(node)
        self._joined = (context, executor)
        return node

    @cached_property
    def graph(self) -> Node:
        """The same node, once the graph that it sees has settled."""
        node = self.node
        self._settled_at = time.monotonic() + _SETTLED_WITHIN
        spin_time = getattr(self.options, "spin_time", None)
        if self._observer is not None and spin_time is None:
            watching = self._observer.node
            self._wait_until(lambda: _seen(node) == _seen(watching), _SETTLED_WITHIN)
            self._settled_at = 0.0
            return node
        self._wait_until(lambda: False, SPIN_TIME if spin_time is None else spin_time)
        if spin_time is not None:
            self._settled_at = 0.0
            return node
        before: list[Any] = [None, 0.0]

        def settled() -> bool:
            now, looked = time.monotonic(), before[1]
            if now - looked < _STILL:
                return False
            seen = _seen(node)
            still, before[:] = seen == before[0], [seen, now]
            return still and any(seen) and _complete(node)

        self._wait_until(settled, _SETTLED_WITHIN - SPIN_TIME)
        return node

    def look_for(self, find: Callable[[], _Found | None]) -> _Found | None:
        """What `find` gives: asked once more as long as something may yet appear on the graph."""
        _ = self.graph
        while (found := find()) is None and (now := time.monotonic()) < self._settled_at:
            self._go_on(now)
            time.sleep(_POLL)
        return found

    def nodes(self, hidden: bool = False) -> list[tuple[str, str]]:
        """Namespace and name of every node but the kit's own observers; sorted by full name."""
        found = [(space, name) for name, space in self.graph.get_node_names_and_namespaces()]
        shown = [one for one in found if not _OWN.fullmatch(one[1]) and (hidden or not one[1].startswith("_"))]
        return sorted(shown, key=lambda one: full_name(*one))

    def node_names(self, hidden: bool = False) -> list[str]:
        """Full names of the nodes."""
        return [full_name(*one) for one in self.nodes(hidden)]

    def topics(self, hidden: bool = False) -> list[tuple[str, list[str]]]:
        """Topics with their types; sorted. Those that only an observer of the kit uses are left out."""
        return sorted(
            (name, types)
            for name, types in self.graph.get_topic_names_and_types()
            if (hidden or not is_hidden(name)) and (self.publishers(name) or self.subscriptions(name))
        )

    def publishers(self, topic: str) -> list[TopicEndpointInfo]:
        """Publishers of a topic, without those of the kit's observers."""
        return [end for end in self.graph.get_publishers_info_by_topic(topic) if not _OWN.fullmatch(end.node_name)]

    def subscriptions(self, topic: str) -> list[TopicEndpointInfo]:
        """Subscriptions to a topic, without those of the kit's observers."""
        return [end for end in self.graph.get_subscriptions_info_by_topic(topic) if not _OWN.fullmatch(end.node_name)]

    def services(self, hidden: bool = False) -> list[tuple[str, list[str]]]:
        """Services with their types; sorted."""
        found = self.graph.get_service_names_and_types()
        return sorted((name, types) for name, types in found if hidden or not is_hidden(name))

    def spin_until(self, done: Callable[[], object], within: float | None = None) -> bool:
        """Let the node work until `done()`; whether it came within so many seconds.

        Raises:
            TimeIsUp: the verb has to end.
        """
        deadline = None if within is None else time.monotonic() + within
        _ = self.node
        assert self._joined is not None
        while not done():
            now = time.monotonic()
            if deadline is not None and now >= deadline:
                return False
            self._go_on(now)
            left = [at - now for at in (deadline, self._ends) if at is not None]
            with _whole_round():
                self._joined[1].spin_once(timeout_sec=max(0.0, min([0.1, *left])))
        return True

    def answer(self, future: Any, within: float | None = None) -> Any:
        """What a future gives, or None if nothing came in time."""
        return future.result() if self.spin_until(future.done, within) else None

    def give_more_time(self, seconds: float) -> None:
        """Let a verb that has to end, end properly."""
        if self._ends is not None:
            self._ends = time.monotonic() + seconds

    def _wait_until(self, done: Callable[[], object], within: float) -> None:
        deadline = time.monotonic() + within
        while not done() and (now := time.monotonic()) < deadline:
            self._go_on(now)
            time.sleep(min(_POLL, deadline - now))

    def _go_on(self, now: float) -> None:
        if self._ends is not None and now >= self._ends:
            raise TimeIsUp

    def close(self) -> None:
        """Leave the graph. Can be called twice."""
        if self._joined is not None:
            context, executor = self._joined
            self._joined = None
            executor.shutdown(timeout_sec=1.0)
            self.node.destroy_node()
            context.try_shutdown()


@contextlib.contextmanager
def _whole_round() -> Iterator[None]:
    """Let Ctrl-C wait until an executor's round is over.

    In the midst of one it would leave an answer half taken, or a callback group that is never free again; whoever then
    asks for one thing more, as for a goal to be cancelled, would wait in vain.
    """
    # Signals come to the main thread only, and to nobody whom a shell has put into the background.
    if threading.current_thread() is not threading.main_thread() or signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        yield
        return
    came: list[int] = []
    before = signal.signal(signal.SIGINT, lambda number, _: came.append(number))
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)
    if came:
        raise KeyboardInterrupt


def is_hidden(name: str) -> bool:
    """Whether a part of a topic's or service's name begins with an underscore."""
    return any(part.startswith("_") for part in name.split("/"))


def _seen(node: Node) -> Any:
    """All that a node sees of the graph, but what the kit and the verb itself brought."""

    def foreign(name: str) -> bool:
        return not (_OWN.fullmatch(name) or name.startswith(PREFIX))

    ends: set[bytes] = set()
    for topic, _ in node.get_topic_names_and_types():
        for end in [*node.get_publishers_info_by_topic(topic), *node.get_subscriptions_info_by_topic(topic)]:
            if foreign(end.node_name):
                ends.add(bytes(end.endpoint_gid))
    nodes = sorted(one for one in node.get_node_names_and_namespaces() if foreign(one[0]))
    services = sorted(name for name, _ in node.get_service_names_and_types() if not name.startswith(f"/{PREFIX}"))
    return nodes, ends, services


def _complete(node: Node) -> bool:
    """Whether every endpoint's node and every node's endpoints are known; a node publishes its parameters' events."""
    for topic, _ in node.get_topic_names_and_types():
        ends = [*node.get_publishers_info_by_topic(topic), *node.get_subscriptions_info_by_topic(topic)]
        if any(end.node_name == UNKNOWN_NODE for end in ends):
            return False
    writers = {(end.node_name, end.node_namespace) for end in node.get_publishers_info_by_topic("/parameter_events")}
    return all(one in writers for one in node.get_node_names_and_namespaces())
