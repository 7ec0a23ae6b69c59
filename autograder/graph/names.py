"""Names on the ROS graph: how they are formed, and which name a student probably meant."""

from __future__ import annotations

from collections.abc import Iterable
from difflib import SequenceMatcher
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rclpy.topic_endpoint_info import TopicEndpointInfo

UNKNOWN_NODE = "_NODE_NAME_UNKNOWN_"
"""The name that the middleware gives to the node of an endpoint as long as it does not know the node."""


def full_name(namespace: str, name: str) -> str:
    """Return the full name of a node from its namespace and name: `/` and `talker` give `/talker`."""
    return f"{namespace.rstrip('/')}/{name}"


def node_of(end: TopicEndpointInfo) -> str:
    """Return the full name of the node to which an endpoint belongs."""
    return full_name(end.node_namespace, end.node_name)


def nearest(wanted: str, names: Iterable[str]) -> str | None:
    """Return the name most similar to `wanted`, the alphabetically first if several are; None if none is similar."""
    best, score = None, 0.55
    for name in sorted(set(names)):
        likeness = SequenceMatcher(None, wanted, name).ratio()
        if name.rsplit("/", 1)[-1] == wanted.rsplit("/", 1)[-1]:
            likeness += 0.3
        if likeness > score:
            best, score = name, likeness
    return best


def type_name(interface: type) -> str:
    """Return the type name of an interface class, such as `std_msgs/msg/String` for `std_msgs.msg.String`.

    Raises:
        TypeError: the argument is not a class.
    """
    if not isinstance(interface, type):
        raise TypeError(f"{interface!r:.80} is not a message class; import one, such as std_msgs.msg.String")
    package, kind = interface.__module__.split(".")[:2]
    return f"{package}/{kind}/{interface.__name__}"
