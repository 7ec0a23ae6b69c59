"""The observer: a node with its own context that watches the graph of one launch.

It is not a student's node, and it shares no process with one. It has no services and does not publish on /rosout, so
that it adds as little as possible to the graph.
"""

from __future__ import annotations

import contextlib
import threading
import time
from collections import Counter, deque
from collections.abc import Callable
from typing import Any

import rclpy
from rclpy.action import ActionClient
from rclpy.context import Context
from rclpy.event_handler import PublisherEventCallbacks
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.qos import QoSProfile
from rclpy.topic_endpoint_info import TopicEndpointInfo

from autograder.core import interrupts
from autograder.core.errors import KitError
from autograder.graph.names import UNKNOWN_NODE, full_name
from autograder.graph.patience import Patience
from autograder.graph.recording import Bag, Recording, quiet_profile

POLL = 0.02
"""The seconds between two checks while waiting. Polling is needed because rclpy does not report every graph change."""

_LONGEST_POLL = 0.1
_POLLS_A_WAIT = 10
"""A longer wait checks less often, so it ends late by at most a tenth of the time that it has taken."""

RECORDED = 128 * 1024 * 1024
"""The bytes of messages that one observer keeps; later messages are dropped."""

_ANSWERS = 20
"""The number of answers that an observer keeps, in case one of them causes an error in a check."""

OBSERVER_NAME = "grading_observer"

_EVENTS = "/parameter_events"
"""The topic on which every node of rclpy and of rclcpp has a publisher, unless it is told to have none."""


class ForgedGraph(Exception):
    """A program bypassed ROS and announced an invalid node or topic name to DDS, so that the graph is unreadable."""


class Observer:
    """Watches one ROS domain.

    Args:
        domain_id: the domain of the launch, 0 to 101.
        patience: how much longer its waits may take than requested; by default, a full patience for one check.
        left: called when the observer has left the domain, also if it could not start.
        bag: keeps the messages that are received; by default, a new bag.
    """

    def __init__(
        self,
        domain_id: int,
        patience: Patience | None = None,
        left: Callable[[], None] | None = None,
        bag: Bag | None = None,
    ) -> None:
        """Join the domain and start to spin in a separate thread."""
        with contextlib.ExitStack() as leaving:  # nothing is left behind if starting fails at any point
            if left is not None:
                leaving.callback(left)
            self.bag = bag or Bag()
            self._join(leaving, domain_id, patience)
            self._leaving = leaving.pop_all()

    def _join(self, leaving: contextlib.ExitStack, domain_id: int, patience: Patience | None) -> None:
        self.domain_id = domain_id
        self.patience = patience or Patience()
        self.changed = threading.Condition()
        self._context = Context()
        rclpy.init(context=self._context, domain_id=domain_id, args=[])
        leaving.callback(rclpy.try_shutdown, context=self._context)
        # The random suffix prevents a student's node from having this name by chance. The observer's own endpoints are
        # recognised by their participant, because any program can read a name from the graph and use it.
        self.name = f"{OBSERVER_NAME}_{time.monotonic_ns() % 0xFFFFFF:06x}"
        self.node: Node = rclpy.create_node(
            self.name,
            context=self._context,
            start_parameter_services=False,
            enable_rosout=False,
            enable_logger_service=False,
            use_global_arguments=False,
            parameter_overrides=[Parameter("start_type_description_service", value=False)],
        )
        leaving.callback(leave_graph, self.node)
        self._participant = self._own_participant()
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self.node)
        self._recordings: dict[tuple[str, str], Recording] = {}
        self._quiet = quiet_profile()
        self._quiet_text = str(self._quiet)
        self._room = RECORDED
        self.answers: deque[tuple[str, Any]] = deque(maxlen=_ANSWERS)
        """The last answers of services and actions, each with the name of the service or action."""
        self.meanwhile: Callable[[], None] | None = None
        """Called at intervals in the thread that waits."""
        self._closing = False
        self._error: Exception | None = None
        """What ended the thread that spins."""
        self._thread = threading.Thread(target=self._spin, name="observer", daemon=True)
        self._thread.start()

    def _own_participant(self) -> bytes:
        """Return the GUID prefix of the observer's endpoints, read from its publisher on `/parameter_events`.

        Every rclpy node has such a publisher.
        """
        deadline = time.monotonic() + 30.0
        while time.monotonic() < deadline:
            for end in self.node.get_publishers_info_by_topic("/parameter_events"):
                if end.node_name == self.name:
                    return _participant(end)
            time.sleep(POLL)
        raise KitError("The observer does not find itself in the ROS graph.", "Run the command again.")

    def _spin(self) -> None:
        try:
            self._executor.spin()
        except ExternalShutdownException:
            pass  # caused by shutting down all contexts, as rclpy does at Ctrl-C
        except Exception as raised:
            # If the context or the executor is shut down just as it begins to wait, it raises an error that does not
            # matter.
            if self._context.ok() and not self._closing:
                self._error = raised

    def _failure(self) -> Exception | None:
        """Return why the observer receives nothing any more, or None.

        The context is asked and not the thread that spins. At Ctrl-C, rclpy 7.1 wakes the executor first and shuts the
        context down after that (`signal_handler.cpp`), so the executor may wait again and never end.
        """
        if self._error is None and not self._closing and not self._context.ok():
            return RuntimeError("its ROS context was shut down")
        return self._error

    def close(self) -> None:
        """Leave the domain. The thread is joined because a daemon thread that spins at exit would abort the process."""
        self._closing = True
        with self._leaving:
            self._executor.shutdown(timeout_sec=2.0)
            rclpy.try_shutdown(context=self._context)
            self._thread.join(timeout=5.0)

    def room_for(self, size: int, kept: int) -> bool:
        """Reserve room for a message of `size` bytes in a recording that keeps `kept` bytes; False if there is none.

        A recording gets no more room than is left for all others, because a flooded topic must not silence the rest.
        """
        if kept + size > self._room:
            return False
        self._room -= size
        return True

    def notify(self) -> None:
        """Wake all threads that wait, because something has happened."""
        with self.changed:
            self.changed.notify_all()

    def wait(self, ready: Callable[[], object], within: float, give_up: Callable[[], bool] | None = None) -> bool:
        """Wait until `ready()` is true, at most `within` seconds, or until `give_up()` says that nothing can change.

        Time in which the grader or a program wanted to run but got no CPU because of other processes does not count, as
        long as there is patience, because a verdict must not depend on what else the machine does. `ready` is checked
        once more after the deadline.

        Raises:
            KitError: the observer receives nothing any more.
        """
        began, came, within = time.monotonic(), False, max(0.0, within)
        self.patience.withheld.measure()
        try:
            came = self._wait(ready, began, within, give_up or (lambda: False))
        finally:
            self.patience.waited(began, within, came)
        return came

    def _wait(self, ready: Callable[[], object], began: float, within: float, give_up: Callable[[], bool]) -> bool:
        deadline = began + within
        while True:
            now = time.monotonic()
            if now >= deadline:
                deadline = began + within + self.patience.more(began, within)
            else:
                self.patience.withheld.measure()
            if (failure := self._failure()) is not None:  # otherwise the silence would be blamed on the program
                raise KitError(f"The observer hears nothing any more: {failure!r}.", "Run it again.")
            late = now >= deadline or self._closing or give_up()
            if ready():
                return True
            if late:
                return False
            interrupts.here()
            if self.meanwhile is not None:
                self.meanwhile()
            poll = min(max(POLL, (now - began) / _POLLS_A_WAIT), _LONGEST_POLL)
            with self.changed:
                self.changed.wait(min(poll, max(0.0, deadline - time.monotonic())))

    def pause(self, seconds: float) -> None:
        """Wait exactly `seconds`, for experiments in which the length of the time matters."""
        deadline = time.monotonic() + seconds
        while (left := deadline - time.monotonic()) > 0:
            interrupts.here()
            if self.meanwhile is not None:
                self.meanwhile()
            self.patience.withheld.measure()
            with self.changed:
                self.changed.wait(min(left, 5 * POLL))

    def nodes(self) -> list[str]:
        """Return the full names of all nodes except the observer. A name that two nodes have is listed twice."""
        found = self._names()
        if (self.name, "/") in found:
            found.remove((self.name, "/"))  # once, so that another node with the same name stays
        return sorted(full_name(namespace, name) for name, namespace in found)

    def _names(self) -> list[tuple[str, str]]:
        """Return the names and namespaces of all nodes."""
        try:
            found: list[tuple[str, str]] = _read(self.node.get_node_names_and_namespaces)
        except RuntimeError as error:  # rclpy's RCLError is a RuntimeError
            if "empty node name" in str(error):  # rcl does not allow a program to create such a node
                raise ForgedGraph from error
            raise
        if self.node.count_publishers(_EVENTS) >= len(found):
            return found
        return self._without_left_over(found)

    def _without_left_over(self, found: list[tuple[str, str]]) -> list[tuple[str, str]]:
        """Leave out the nodes that have no publisher, so that a node whose process has ended is not on the graph.

        A process that ends announces this to DDS, and before that it tells which nodes it still has. The middleware
        reads the two in different threads. If it reads the older news last, it lists the node forever, without any
        publisher (seen with rclpy 7.1 in 1 of 80 processes; `GraphCache::update_participant_entities` in
        rmw_dds_common adds a participant that it does not know).
        """
        ends = _read(self.node.get_publishers_info_by_topic, _EVENTS)
        there = Counter((end.node_name, end.node_namespace) for end in ends)
        if any(end.node_name == UNKNOWN_NODE for end in ends):  # of two nodes of one name in one process
            return found
        left_over = Counter(found) - there
        kept = []
        for name in found:
            if left_over[name] and (there[name] or not self._publishes(*name)):
                left_over[name] -= 1
            else:
                kept.append(name)
        return kept

    def _publishes(self, name: str, namespace: str) -> bool:
        """Whether a node of this name has any publisher, also where its `/parameter_events` has another name."""
        with contextlib.suppress(RuntimeError, ValueError):  # as in `_services_of`
            return bool(self.node.get_publisher_names_and_types_by_node(name, namespace))
        return False

    def topics(self) -> dict[str, list[str]]:
        """Return the topics with their type names, except those that only the observer uses."""
        return {
            name: types
            for name, types in _read(self.node.get_topic_names_and_types)
            if self.publishers(name) or self.subscriptions(name)
        }

    def publishers(self, topic: str) -> list[TopicEndpointInfo]:
        """Return the publishers on a topic, except the observer's own."""
        ends = _read(self.node.get_publishers_info_by_topic, topic)
        return [end for end in ends if _participant(end) != self._participant]

    def subscriptions(self, topic: str) -> list[TopicEndpointInfo]:
        """Return the subscriptions to a topic, except the observer's own."""
        ends = _read(self.node.get_subscriptions_info_by_topic, topic)
        return [end for end in ends if _participant(end) != self._participant]

    def services(self) -> dict[str, list[str]]:
        """Return the services of all nodes with their type names; the observer itself offers none."""
        found: dict[str, list[str]] = {}
        for name, namespace in self._names():
            found.update(self._services_of(name, namespace))
        return found

    def services_of(self, node: str) -> dict[str, list[str]]:
        """Return the services that a node offers with their type names.

        Args:
            node: the full name of the node.
        """
        namespace, _, name = node.rpartition("/")
        return self._services_of(name, namespace or "/")

    def _services_of(self, name: str, namespace: str) -> dict[str, list[str]]:
        # A node may disappear after its name was read, which causes an RCLError; forged names may not be UTF-8.
        with contextlib.suppress(RuntimeError, ValueError):
            return dict(self.node.get_service_names_and_types_by_node(name, namespace))
        return {}

    def clients(self, node: str) -> dict[str, list[str]]:
        """Return the services for which a node has clients, with the clients' types.

        Args:
            node: the full name of the node.
        """
        namespace, _, name = node.rpartition("/")
        with contextlib.suppress(RuntimeError, ValueError):  # as in `_services_of`
            return dict(self.node.get_client_names_and_types_by_node(name, namespace or "/"))
        return {}

    def record(self, topic: str, msg_type: type, qos: QoSProfile | None = None) -> Recording:
        """Subscribe to a topic and keep every message. There is only one recording for each topic and profile.

        Args:
            topic: the full name of the topic.
            msg_type: the message class.
            qos: the subscription's profile; by default best effort and volatile with a deep queue, which matches every
                publisher whatever it offers.
        """
        profile = qos or self._quiet
        # A profile's repr would distinguish objects, not policies, so its str is the key. To make that text takes long
        # and this is called very often, so the text of the default profile is made only once.
        key = (topic, self._quiet_text if qos is None else str(profile))
        if key not in self._recordings:
            self._recordings[key] = Recording(self, topic, msg_type, profile)
        return self._recordings[key]

    def recordings(self) -> list[Recording]:
        """Return all recordings that exist so far."""
        return list(self._recordings.values())

    def hears_all(self) -> bool:
        """Whether every recording with the default profile has matched all publishers that are now on its topic."""
        return all(
            recording.matched >= len(self.publishers(topic))
            for (topic, profile), recording in list(self._recordings.items())
            if profile == self._quiet_text
        )

    def publisher(self, topic: str, msg_type: type, qos: QoSProfile) -> Any:
        """Create a publisher of the observer, without rclpy's warnings about subscriptions that do not match."""
        quiet = PublisherEventCallbacks(use_default_callbacks=False)
        return self.node.create_publisher(msg_type, topic, qos, event_callbacks=quiet)

    def sends_on(self) -> set[str]:
        """Return the full names of the topics on which the observer itself publishes."""
        return {publisher.topic_name for publisher in self.node.publishers}


def leave_graph(node: Node) -> None:
    """Destroy a node with everything that was created on it.

    rclpy does not destroy a node's action clients, and as long as one exists, so do the node and its participant.
    """
    for waitable in list(node.waitables):
        if isinstance(waitable, ActionClient):
            waitable.destroy()
    node.destroy_node()


def _read(ask: Callable[..., Any], *about: str) -> Any:
    """Return what rclpy says about the graph.

    Raises:
        ForgedGraph: a name in the graph is not UTF-8, which ROS refuses, but DDS does not.
    """
    try:
        return ask(*about)
    except UnicodeDecodeError as error:
        raise ForgedGraph from error


def _participant(end: TopicEndpointInfo) -> bytes:
    """Return the part of an endpoint's GID that all endpoints of a participant share (RTPS 2.5, GUID prefix)."""
    return bytes(end.endpoint_gid)[:12]
