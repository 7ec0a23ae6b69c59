"""The node that a verb uses, and its view of the graph.

The real tool asks a daemon that has already discovered the graph. A verb of the kit joins the graph itself, and waits
until its view of the graph is complete.
"""

from __future__ import annotations

import contextlib
import os
import re
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, TypeVar

import rclpy
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.topic_endpoint_info import TopicEndpointInfo

from autograder.core import interrupts
from autograder.graph.names import UNKNOWN_NODE, full_name
from autograder.graph.observer import OBSERVER_NAME, Observer, leave_graph
from autograder.ros2.failure import Failure, TimeIsUp
from autograder.sandbox.environment import FASTDDS_PROFILE

PREFIX = "_ros2cli"
"""The beginning of the names of the real tool's nodes. They are hidden because of the underscore."""

_OBSERVER = re.compile(rf"{OBSERVER_NAME}_[0-9a-f]{{6}}")
_WHO_HAS_WHAT = "ros_discovery_info"
"""The topic on which a participant publishes which of its readers and writers belong to which of its nodes."""
_PARTICIPANT = 12
"""The number of bytes of an endpoint's GID that identify its participant. The next three bytes are the number of the
endpoint in its participant, from 1."""


def is_observer(node_name: str) -> bool:
    """Whether a node is one of the kit's own observers, which are never shown."""
    return _OBSERVER.fullmatch(node_name) is not None


@dataclass(frozen=True)
class _End:
    topic: str
    node: str
    number: int
    writes: bool


@dataclass(frozen=True)
class GraphView:
    """Everything that a node has discovered of the graph, without the kit's own nodes and their endpoints.

    A node that has just joined discovers the others gradually. Each participant, which is one process with all its
    nodes, sends the list of its writers and the list of its readers, each in the order in which they were created.
    Separately, it sends which node has which of them. These pieces arrive in any order, and on a busy machine seconds
    apart. So even if nothing has changed for a while, something may still be missing.
    """

    nodes: list[str]
    """The full names of the nodes."""
    ends: dict[bytes, _End]
    """Every reader and writer by its GID, including those of services."""
    participants: int
    """The number of discovered participants, including those of the kit."""

    def __bool__(self) -> bool:
        """Whether a node or an endpoint has been discovered."""
        return bool(self.nodes or self.ends)

    def is_complete(self) -> bool:
        """Whether nothing is known to be missing from any discovered participant."""
        if not set(self.nodes) <= {end.node for end in self.ends.values()}:
            return False
        by_participant: dict[bytes, list[_End]] = {}
        for gid, end in self.ends.items():
            by_participant.setdefault(gid[:_PARTICIPANT], []).append(end)
        return all(map(_is_whole, by_participant.values()))


def _is_whole(ends: list[_End]) -> bool:
    """Whether no reader or writer of one participant is missing, and the node of each is known."""
    own = [end for end in ends if end.topic != _WHO_HAS_WHAT]
    if not own or any(end.node.endswith(UNKNOWN_NODE) for end in own):
        return False
    # Writers arrive in order, and so do readers. A missing number that is lower than the last numbers of both lists
    # belongs to a destroyed endpoint. A missing number above one of them may not have been discovered yet.
    last = [max((end.number for end in ends if end.writes == writes), default=0) for writes in (True, False)]
    return {end.number for end in ends} >= set(range(min(last) + 1, max(last)))


def look(node: Node) -> GraphView:
    """Return what a node has discovered so far."""
    found = dict(_ends(node))
    kits = {gid[:_PARTICIPANT] for gid, end in found.items() if _is_the_kits(end.node.rpartition("/")[2])}
    return GraphView(
        sorted(
            full_name(space, name) for name, space in node.get_node_names_and_namespaces() if not _is_the_kits(name)
        ),
        {gid: end for gid, end in found.items() if gid[:_PARTICIPANT] not in kits},
        len({gid[:_PARTICIPANT] for gid in found}),
    )


def _is_the_kits(node_name: str) -> bool:
    return is_observer(node_name) or node_name.startswith(PREFIX)


def _ends(node: Node) -> Iterator[tuple[bytes, _End]]:
    for topic, _ in node.get_topic_names_and_types(no_demangle=True):
        for writes, ask in ((True, node.get_publishers_info_by_topic), (False, node.get_subscriptions_info_by_topic)):
            for end in ask(topic, no_mangle=True):
                gid = bytes(end.endpoint_gid)
                number = int.from_bytes(gid[_PARTICIPANT : _PARTICIPANT + 3], "big")
                yield gid, _End(topic, full_name(end.node_namespace, end.node_name), number, writes)


def participants_here(domain_id: int) -> int:
    """Return the number of a domain's participants on this machine, according to their ports; 0 if it is not known.

    The ports are those of the RTPS specification: there are 250 for each domain, and on every second one from the tenth
    on, a participant receives discovery messages. In the multicast group of a launch, they begin 120 higher, after the
    two ports of the group.
    """
    in_group = os.environ.get("FASTRTPS_DEFAULT_PROFILES_FILE") == str(FASTDDS_PROFILE)
    first = 7400 + 250 * domain_id + (130 if in_group else 10)
    try:
        lines = Path("/proc/net/udp").read_text(encoding="ascii").splitlines()[1:]
        ports = {int(line.split()[1].rpartition(":")[2], 16) for line in lines}
    except (OSError, ValueError, IndexError):
        return 0
    return len(ports.intersection(range(first, first + 118, 2)))


_POLL = 0.05
"""The seconds between two looks at the graph. The following values are numbers of looks, because on a busy machine a
look takes longer, and so does discovery."""
_LISTENED = 10
"""The least number of looks: half a second, which is as long as the real tool listens without its daemon."""
_STILL = 4
"""The number of equal looks in a row that are needed if nothing is known to be missing."""
_REPEATED = 66
"""The number of equal looks in a row that are needed otherwise. They take longer than the 3 seconds after which the
middleware repeats a lost discovery packet."""
_MOST = 300
"""The number of looks after which the graph is used as it is, with a warning."""

_Found = TypeVar("_Found")


class Session:
    """The time during which a verb is on the graph. It joins the graph at the first use and leaves it with `close`.

    Args:
        domain_id: ROS_DOMAIN_ID, or None for that of the environment.
        observer: an observer that has already discovered the whole graph.
        seconds: the time limit of the verb, or None if only Ctrl-C ends it.
    """

    def __init__(self, domain_id: int | None, observer: Observer | None = None, seconds: float | None = None) -> None:
        """Prepare the session without joining the graph."""
        self._domain_id = domain_id
        self._observer = observer
        self._ends = None if seconds is None else time.monotonic() + seconds
        self.options: Any = None
        """The parsed words of the verb."""
        self.name = f"{PREFIX}_{os.getpid()}"
        self._joined: SingleThreadedExecutor | None = None
        self._leaving = contextlib.ExitStack()
        self._looks_left = 0

    @cached_property
    def node(self) -> Node:
        """The node that the verb uses."""
        context = Context()
        sim_time = [Parameter("use_sim_time", value=True)] if getattr(self.options, "use_sim_time", False) else []
        with contextlib.ExitStack() as leaving:  # nothing is left behind after an interruption
            rclpy.init(context=context, domain_id=self._domain_id, args=[])
            leaving.callback(context.try_shutdown)
            node = rclpy.create_node(
                self.name,
                context=context,
                start_parameter_services=False,
                use_global_arguments=False,
                parameter_overrides=sim_time,
            )
            leaving.callback(leave_graph, node)
            executor = SingleThreadedExecutor(context=context)
            executor.add_node(node)
            self._joined = executor
            self._leaving = leaving.pop_all()
        return node

    @cached_property
    def graph(self) -> Node:
        """The same node, after its view of the graph has settled."""
        node = self.node
        spin_time = getattr(self.options, "spin_time", None)
        if spin_time is not None:
            deadline = time.monotonic() + spin_time
            self._look_until(lambda: time.monotonic() >= deadline, sys.maxsize)
        elif self._observer is not None:
            watching = self._observer.node
            self._look_until(lambda: look(node) == look(watching), _REPEATED)
        else:
            self._listen(node)
        return node

    def _listen(self, node: Node) -> None:
        """Look at the graph until nothing more is expected."""
        domain = node.context.get_domain_id()
        before, looks, still, silent = None, 0, 0, False

        def settled() -> bool:
            nonlocal before, looks, still, silent
            seen = look(node)
            looks += 1
            still = still + 1 if seen == before else 0
            before = seen
            if looks < _LISTENED or still < _STILL:
                return False
            silent = seen.participants < participants_here(domain)
            return still >= _REPEATED * (1 + silent) or (not silent and bool(seen) and seen.is_complete())

        if not self._look_until(settled, _MOST):
            print("WARNING: the graph keeps changing: what follows may not be all of it.", file=sys.stderr)
        elif silent:
            print("WARNING: a program here does not answer: what follows may not be all there is.", file=sys.stderr)
        self._looks_left = max(0, _REPEATED - looks)

    def look_for(self, find: Callable[[], _Found | None], within: float | None = None) -> _Found | None:
        """Return the result of `find`.

        While it is None, `find` is called again as long as something may still appear on the graph, or for `within`
        seconds.
        """
        _ = self.graph
        deadline = time.monotonic() + (within or 0.0)
        while (found := find()) is None and (self._looks_left > 0 or time.monotonic() < deadline):
            self._looks_left -= 1
            self._go_on(time.monotonic())
            time.sleep(_POLL)
        return found

    def nodes(self, hidden: bool = False) -> list[tuple[str, str]]:
        """Return the namespace and name of every node except the kit's observers, sorted by full name."""
        found = [(space, name) for name, space in self.graph.get_node_names_and_namespaces()]
        shown = [one for one in found if not is_observer(one[1]) and (hidden or not one[1].startswith("_"))]
        return sorted(shown, key=lambda one: full_name(*one))

    def node_names(self, hidden: bool = False) -> list[str]:
        """Return the full names of the nodes."""
        return [full_name(*one) for one in self.nodes(hidden)]

    def topics(self, hidden: bool = False) -> list[tuple[str, list[str]]]:
        """Return the sorted topics with their types, except topics that only an observer of the kit uses."""
        return sorted(
            (name, types)
            for name, types in self.graph.get_topic_names_and_types()
            if (hidden or not is_hidden(name)) and (self.publishers(name) or self.subscriptions(name))
        )

    def publishers(self, topic: str) -> list[TopicEndpointInfo]:
        """Return the publishers on a topic, except those of the kit's observers."""
        return [end for end in self.graph.get_publishers_info_by_topic(topic) if not is_observer(end.node_name)]

    def subscriptions(self, topic: str) -> list[TopicEndpointInfo]:
        """Return the subscriptions to a topic, except those of the kit's observers."""
        return [end for end in self.graph.get_subscriptions_info_by_topic(topic) if not is_observer(end.node_name)]

    def services(self, hidden: bool = False) -> list[tuple[str, list[str]]]:
        """Return the sorted services with their types."""
        found = self.graph.get_service_names_and_types()
        return sorted((name, types) for name, types in found if hidden or not is_hidden(name))

    def spin_until(self, done: Callable[[], object], within: float | None = None) -> bool:
        """Spin the node until `done()` is true, and return whether that happened within `within` seconds.

        Raises:
            TimeIsUp: the time limit of the verb is over.
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
                self._joined.spin_once(timeout_sec=max(0.0, min([0.1, *left])))
        return True

    def stay(self, seconds: float) -> None:
        """Stay on the graph for some seconds without doing anything.

        Raises:
            TimeIsUp: the time limit of the verb is over.
        """
        deadline = time.monotonic() + seconds
        while (left := deadline - time.monotonic()) > 0:
            self._go_on(time.monotonic())
            time.sleep(min(left, _POLL))

    def answer(self, future: Any, within: float | None = None) -> Any:
        """Return the result of a future, or None if it did not come in time."""
        return future.result() if self.spin_until(future.done, within) else None

    def give_more_time(self, seconds: float) -> None:
        """Extend the time limit, so that a verb can end properly."""
        if self._ends is not None:
            self._ends = time.monotonic() + seconds

    def _look_until(self, done: Callable[[], bool], looks: int) -> bool:
        """Wait until `done()`, which looks at the graph, is true, and return whether it was within so many looks."""
        for _ in range(looks):
            if done():
                return True
            self._go_on(time.monotonic())
            time.sleep(_POLL)
        return False

    def _go_on(self, now: float) -> None:
        interrupts.here()
        if self._ends is not None and now >= self._ends:
            raise TimeIsUp

    def close(self) -> None:
        """Leave the graph. This can be called twice."""
        with self._leaving:
            if self._joined is not None:
                self._joined.shutdown(timeout_sec=1.0)
                self._joined = None


@contextlib.contextmanager
def _whole_round() -> Iterator[None]:
    """Delay Ctrl-C until an executor's round is over.

    In the middle of a round, Ctrl-C could leave a response half processed, or a callback group occupied forever. A
    later request, such as that to cancel a goal, would then never get a response.
    """
    # Signals come only to the main thread, and not to programs that a shell has started in the background.
    elsewhere = threading.current_thread() is not threading.main_thread()
    if elsewhere or interrupts.held() or signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
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


_READY_WITHIN = 5.0
"""The seconds that a service of a node may take to appear after the node is on the graph, as in the real tool."""


def ask(session: Session, node: str, service: str, srv_type: Any, request: Any, within: float | None = None) -> Any:
    """Return the response of a node's service, or None if it did not come within `within` seconds.

    Raises:
        Failure: the service does not exist.
    """
    client = session.node.create_client(srv_type, f"{node}/{service}")
    if not session.spin_until(client.service_is_ready, _READY_WITHIN):
        raise Failure("Wait for service timed out")
    return session.answer(client.call_async(request), within)
