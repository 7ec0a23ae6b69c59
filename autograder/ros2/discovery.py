"""What a node has heard of the graph so far, and whether that can be all there is.

A node that has just joined hears of the others piece by piece. Each participant, which is one process with all its
nodes, sends the list of its writers and that of its readers, each in the order in which they were made, and apart from
both which node has which of them. The pieces come in any order, and on a busy machine seconds apart: that nothing has
changed for a while does not mean that nothing is missing.
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from rclpy.node import Node

from autograder.graph.names import UNKNOWN_NODE, full_name
from autograder.graph.observer import OBSERVER_NAME
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
    """All that a node has heard of the graph; what the kit's own nodes have is left out."""

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
