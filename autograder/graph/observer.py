"""The observer: one node, in a context of its own, that watches the graph of one launch.

It is not a student's node and shares no process with one. It stays quiet: no services, no /rosout.
"""

from __future__ import annotations

import contextlib
import threading
import time
from collections import deque
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
from autograder.graph.names import full_name
from autograder.graph.patience import Patience
from autograder.graph.recording import Bag, Recording, quiet_profile

POLL = 0.02
"""Seconds between two looks at the graph while waiting: rclpy reports messages, but not every graph change."""

_LONGEST_POLL = 0.1
_POLLS_A_WAIT = 10
"""A wait that goes on looks less often: it ends late by a tenth of what it has taken at the most."""

RECORDED = 128 * 1024 * 1024
"""Bytes of messages that one observer keeps; what comes later is let go by."""

_ANSWERS = 20
"""Answers that an observer keeps, for a check that breaks over one of them."""

OBSERVER_NAME = "grading_observer"


class ForgedGraph(Exception):
    """A program has told DDS of a node or topic whose name is no text, past ROS: the graph cannot be read any more."""


class Observer:
    """Watches one ROS domain.

    Args:
        domain_id: the domain of the launch, 0 to 101.
        patience: how much longer its waits may take than they were asked to; by default, what one check has.
        left: called when it has left the domain, also if it could not begin.
    """

    def __init__(
        self,
        domain_id: int,
        patience: Patience | None = None,
        left: Callable[[], None] | None = None,
        bag: Bag | None = None,
    ) -> None:
        """Join the domain and start to spin in a thread of its own."""
        with contextlib.ExitStack() as leaving:  # nothing stays, wherever a beginning is broken off
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
        # The random end keeps a student's node from having this name by chance; what is the observer's own is told by
        # its participant, because any program can read a name off the graph and use it.
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
        """What services and actions have answered last: of each its name and its answer."""
        self.meanwhile: Callable[[], None] | None = None
        """Called now and then in the thread of whoever waits."""
        self._closing = False
        self._error: Exception | None = None
        """Why it hears nothing any more."""
        self._thread = threading.Thread(target=self._spin, name="observer", daemon=True)
        self._thread.start()

    def _own_participant(self) -> bytes:
        """The GUID prefix of the endpoints made here; every rclpy node publishes its parameters' events."""
        deadline = time.monotonic() + 30.0
        while time.monotonic() < deadline:
            for end in self.node.get_publishers_info_by_topic("/parameter_events"):
                if end.node_name == self.name:
                    return _participant(end)
            time.sleep(POLL)
        raise KitError("The observer does not find itself in the ROS graph.", "Run the command again.")

    def _spin(self) -> None:
        error: Exception = RuntimeError("its ROS context was shut down")
        try:
            self._executor.spin()
        except ExternalShutdownException:
            pass  # by whoever shuts all contexts down, as rclpy does at Ctrl-C
        except Exception as raised:
            error = raised
        # An executor that is shut down as it begins to wait finds what it waits on gone.
        if not self._closing:
            self._error = error

    def close(self) -> None:
        """Leave the domain. The thread is joined: a daemon thread that still spins at exit aborts the process."""
        self._closing = True
        with self._leaving:
            self._executor.shutdown(timeout_sec=2.0)
            rclpy.try_shutdown(context=self._context)
            self._thread.join(timeout=5.0)

    def room_for(self, size: int, kept: int) -> bool:
        """Take room for one more message of `size` bytes, for a recording that keeps `kept` bytes; False if none.

        A recording gets no more than what is left for all others: a topic that is flooded must not silence the rest.
        """
        if kept + size > self._room:
            return False
        self._room -= size
        return True

    def notify(self) -> None:
        """Wake whoever waits: something happened."""
        with self.changed:
            self.changed.notify_all()

    def wait(self, ready: Callable[[], object], within: float, give_up: Callable[[], bool] | None = None) -> bool:
        """Wait until `ready()` is true; at most `within` seconds, less if `give_up()` says that nothing can change.

        Time in which the grader or a program wanted to run and got no CPU because of others does not count, as long as
        there is patience: a verdict must not depend on what else the machine does. The last look comes after the
        deadline.

        Raises:
            KitError: the observer hears nothing any more.
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
            if self._error is not None:  # silence would be held against the program
                raise KitError(f"The observer hears nothing any more: {self._error!r}.", "Run it again.")
            late = now >= deadline or give_up()
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
        """Let time go by, exactly as much as is said: for experiments in which its length matters."""
        deadline = time.monotonic() + seconds
        while (left := deadline - time.monotonic()) > 0:
            interrupts.here()
            if self.meanwhile is not None:
                self.meanwhile()
            self.patience.withheld.measure()
            with self.changed:
                self.changed.wait(min(left, 5 * POLL))

    def nodes(self) -> list[str]:
        """Full names of all nodes but the observer, one entry per node: two nodes of one name are listed twice."""
        found = self._names()
        if (self.name, "/") in found:
            found.remove((self.name, "/"))  # once: another node of this very name stays
        return sorted(full_name(namespace, name) for name, namespace in found)

    def _names(self) -> list[tuple[str, str]]:
        """Names and namespaces of all nodes."""
        try:
            found: list[tuple[str, str]] = _read(self.node.get_node_names_and_namespaces)
        except RuntimeError as error:  # rclpy's RCLError is one
            if "empty node name" in str(error):  # rcl lets no program make such a node
                raise ForgedGraph from error
            raise
        return found

    def topics(self) -> dict[str, list[str]]:
        """Topics and their type names, those that only the observer uses left out."""
        return {
            name: types
            for name, types in _read(self.node.get_topic_names_and_types)
            if self.publishers(name) or self.subscriptions(name)
        }

    def publishers(self, topic: str) -> list[TopicEndpointInfo]:
        """Publishers of a topic, the observer's own left out."""
        ends = _read(self.node.get_publishers_info_by_topic, topic)
        return [end for end in ends if _participant(end) != self._participant]

    def subscriptions(self, topic: str) -> list[TopicEndpointInfo]:
        """Subscriptions to a topic, the observer's own left out."""
        ends = _read(self.node.get_subscriptions_info_by_topic, topic)
        return [end for end in ends if _participant(end) != self._participant]

    def services(self) -> dict[str, list[str]]:
        """Services of all nodes, with their type names; the observer itself offers none."""
        found: dict[str, list[str]] = {}
        for name, namespace in self._names():
            # A node may go away between the two questions, which is an RCLError, and forged names may be no UTF-8.
            with contextlib.suppress(RuntimeError, ValueError):
                found.update(self.node.get_service_names_and_types_by_node(name, namespace))
        return found

    def clients(self, node: str) -> dict[str, list[str]]:
        """Services that a node asks, with the types as which it asks them.

        Args:
            node: its full name.
        """
        namespace, _, name = node.rpartition("/")
        with contextlib.suppress(RuntimeError, ValueError):  # as in `services`
            return dict(self.node.get_client_names_and_types_by_node(name, namespace or "/"))
        return {}

    def record(self, topic: str, msg_type: type, qos: QoSProfile | None = None) -> Recording:
        """Subscribe to a topic and keep every message; the same topic and profile share one recording.

        Args:
            topic: full name.
            msg_type: message class.
            qos: the subscription's profile; by default best effort and volatile with a deep queue, which hears
                every publisher whatever it offers.
        """
        profile = qos or self._quiet
        # Its repr would tell objects apart, not policies; and it takes long, while some ask again all the time.
        key = (topic, self._quiet_text if qos is None else str(profile))
        if key not in self._recordings:
            self._recordings[key] = Recording(self, topic, msg_type, profile)
        return self._recordings[key]

    def recordings(self) -> list[Recording]:
        """All recordings so far."""
        return list(self._recordings.values())

    def hears_all(self) -> bool:
        """Whether every recording that accepts any QoS has matched all publishers that are on its topic by now."""
        return all(
            recording.matched >= len(self.publishers(topic))
            for (topic, profile), recording in list(self._recordings.items())
            if profile == self._quiet_text
        )

    def publisher(self, topic: str, msg_type: type, qos: QoSProfile) -> Any:
        """Make a publisher of the observer's; rclpy's own warnings about subscriptions that do not match are off."""
        quiet = PublisherEventCallbacks(use_default_callbacks=False)
        return self.node.create_publisher(msg_type, topic, qos, event_callbacks=quiet)

    def sends_on(self) -> set[str]:
        """Full names of the topics on which the observer itself publishes."""
        return {publisher.topic_name for publisher in self.node.publishers}


def leave_graph(node: Node) -> None:
    """Destroy a node with all that was made on it.

    rclpy leaves action clients to whoever made them; as long as one is there, so are the node and its participant.
    """
    for waitable in list(node.waitables):
        if isinstance(waitable, ActionClient):
            waitable.destroy()
    node.destroy_node()


def _read(ask: Callable[..., Any], *about: str) -> Any:
    """What rclpy tells of the graph.

    Raises:
        ForgedGraph: a name in it is no UTF-8, which ROS refuses and DDS does not.
    """
    try:
        return ask(*about)
    except UnicodeDecodeError as error:
        raise ForgedGraph from error


def _participant(end: TopicEndpointInfo) -> bytes:
    """The part of an endpoint's GID that all endpoints of a DDS participant have in common (RTPS 2.5, GUID prefix)."""
    return bytes(end.endpoint_gid)[:12]
