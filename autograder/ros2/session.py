"""The node that a verb looks and speaks through, and its view of the graph.

The real tool asks a daemon that has been on the graph for long. A verb of the kit joins the graph itself, and looks at
it when it has settled.
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
"""How the real tool's nodes begin: the underscore hides them."""

_OBSERVER = re.compile(rf"{OBSERVER_NAME}_[0-9a-f]{{6}}")
_WHO_HAS_WHAT = "ros_discovery_info"
"""The topic on which a participant says which of its readers and writers belong to which of its nodes."""
_PARTICIPANT = 12
"""The first bytes of an endpoint's GID; the next three number the endpoint in its participant, from 1 on."""


def is_observer(node_name: str) -> bool:
    """Whether a node is one of the kit's own, which nobody is shown."""
    return _OBSERVER.fullmatch(node_name) is not None


@dataclass(frozen=True)
class _End:
    topic: str
    node: str
    number: int
    writes: bool


@dataclass(frozen=True)
class GraphView:
    """All that a node has heard of the graph; what the kit's own nodes have is left out.

    A node that has just joined hears of the others piece by piece. Each participant, which is one process with all its
    nodes, sends the list of its writers and that of its readers, each in the order in which they were made, and apart
    from both which node has which of them. The pieces come in any order, and on a busy machine seconds apart: that
    nothing has changed for a while does not mean that nothing is missing.
    """

    nodes: list[str]
    """Full names."""
    ends: dict[bytes, _End]
    """By GID: every reader and writer, those of services too."""
    participants: int
    """How many were heard of, the kit's own among them."""

    def __bool__(self) -> bool:
        """Whether anything was."""
        return bool(self.nodes or self.ends)

    def is_complete(self) -> bool:
        """Whether nothing is known to be missing from any participant that was heard of."""
        if not set(self.nodes) <= {end.node for end in self.ends.values()}:
            return False
        by_participant: dict[bytes, list[_End]] = {}
        for gid, end in self.ends.items():
            by_participant.setdefault(gid[:_PARTICIPANT], []).append(end)
        return all(map(_is_whole, by_participant.values()))


def _is_whole(ends: list[_End]) -> bool:
    """Whether of one participant no reader and no writer is missing, and the node of each is known."""
    own = [end for end in ends if end.topic != _WHO_HAS_WHAT]
    if not own or any(end.node.endswith(UNKNOWN_NODE) for end in own):
        return False
    # Writers arrive in order, and so do readers. A number that is missing below the last of both lists belongs to
    # something destroyed; one above may not have been heard of yet.
    last = [max((end.number for end in ends if end.writes == writes), default=0) for writes in (True, False)]
    return {end.number for end in ends} >= set(range(min(last) + 1, max(last)))


def look(node: Node) -> GraphView:
    """What a node has heard by now."""
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
    """How many participants of a domain this machine has, by the ports that they listen on; 0 if that is not known.

    The ports are those of the RTPS specification: 250 for each domain, of which every second one from the tenth on is
    where a participant hears of others. In the multicast group of a launch they begin 120 higher, after the two on
    which the group is heard.
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
"""Seconds between two looks at the graph. What follows counts looks: on a busy machine one takes longer, and so does
what is waited for."""
_LISTENED = 10
"""Looks before what is seen is believed: half a second, as long as the real tool listens without its daemon."""
_STILL = 4
"""Looks that have to be alike where nothing is known to be missing."""
_REPEATED = 66
"""Looks that have to be alike otherwise: the middleware repeats a lost packet of discovery after 3 seconds."""
_MOST = 300
"""Looks after which the graph is taken as it is, and this is said."""

_Found = TypeVar("_Found")


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
        self._joined: SingleThreadedExecutor | None = None
        self._leaving = contextlib.ExitStack()
        self._looks_left = 0

    @cached_property
    def node(self) -> Node:
        """The node that the verb speaks through."""
        context = Context()
        sim_time = [Parameter("use_sim_time", value=True)] if getattr(self.options, "use_sim_time", False) else []
        with contextlib.ExitStack() as leaving:  # nothing stays of what is interrupted
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
        """The same node, once the graph that it sees has settled."""
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
        """Look at the graph until nothing more is to come."""
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
        """What `find` gives: asked again as long as something may yet appear on the graph, or for so many seconds."""
        _ = self.graph
        deadline = time.monotonic() + (within or 0.0)
        while (found := find()) is None and (self._looks_left > 0 or time.monotonic() < deadline):
            self._looks_left -= 1
            self._go_on(time.monotonic())
            time.sleep(_POLL)
        return found

    def nodes(self, hidden: bool = False) -> list[tuple[str, str]]:
        """Namespace and name of every node but the kit's own observers; sorted by full name."""
        found = [(space, name) for name, space in self.graph.get_node_names_and_namespaces()]
        shown = [one for one in found if not is_observer(one[1]) and (hidden or not one[1].startswith("_"))]
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
        return [end for end in self.graph.get_publishers_info_by_topic(topic) if not is_observer(end.node_name)]

    def subscriptions(self, topic: str) -> list[TopicEndpointInfo]:
        """Subscriptions to a topic, without those of the kit's observers."""
        return [end for end in self.graph.get_subscriptions_info_by_topic(topic) if not is_observer(end.node_name)]

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
                self._joined.spin_once(timeout_sec=max(0.0, min([0.1, *left])))
        return True

    def stay(self, seconds: float) -> None:
        """Stay on the graph for so long, and do nothing.

        Raises:
            TimeIsUp: the verb has to end.
        """
        deadline = time.monotonic() + seconds
        while (left := deadline - time.monotonic()) > 0:
            self._go_on(time.monotonic())
            time.sleep(min(left, _POLL))

    def answer(self, future: Any, within: float | None = None) -> Any:
        """What a future gives, or None if nothing came in time."""
        return future.result() if self.spin_until(future.done, within) else None

    def give_more_time(self, seconds: float) -> None:
        """Let a verb that has to end, end properly."""
        if self._ends is not None:
            self._ends = time.monotonic() + seconds

    def _look_until(self, done: Callable[[], bool], looks: int) -> bool:
        """Let time go by until `done()`, which looks at the graph; whether it came within so many looks."""
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
        """Leave the graph. Can be called twice."""
        with self._leaving:
            if self._joined is not None:
                self._joined.shutdown(timeout_sec=1.0)
                self._joined = None


@contextlib.contextmanager
def _whole_round() -> Iterator[None]:
    """Let Ctrl-C wait until an executor's round is over.

    In the midst of one it would leave an answer half taken, or a callback group that is never free again; whoever then
    asks for one thing more, as for a goal to be cancelled, would wait in vain.
    """
    # Signals come to the main thread only, and to nobody whom a shell has put into the background.
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
"""Seconds that a service of a node that is on the graph may take to show up, as with the real tool."""


def ask(session: Session, node: str, service: str, srv_type: Any, request: Any, within: float | None = None) -> Any:
    """The answer of a node's service, or None if it did not come within so many seconds.

    Raises:
        Failure: the service is not there.
    """
    client = session.node.create_client(srv_type, f"{node}/{service}")
    if not session.spin_until(client.service_is_ready, _READY_WITHIN):
        raise Failure("Wait for service timed out")
    return session.answer(client.call_async(request), within)
