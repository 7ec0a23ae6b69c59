"""Names on the ROS graph: how they are put together and which one a student probably meant."""

from __future__ import annotations

from collections.abc import Iterable
from difflib import SequenceMatcher
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rclpy.topic_endpoint_info import TopicEndpointInfo

UNKNOWN_NODE = "_NODE_NAME_UNKNOWN_"
"""What the middleware calls the node of an endpoint whose node it has not heard of yet."""


def full_name(namespace: str, name: str) -> str:
    """Join a namespace and a node name: `/` and `talker` give `/talker`."""
    return f"{namespace.rstrip('/')}/{name}"


def node_of(end: TopicEndpointInfo) -> str:
    """The full name of the node to which an endpoint belongs."""
    return full_name(end.node_namespace, end.node_name)


def nearest(wanted: str, names: Iterable[str]) -> str | None:
    """The name that is most like `wanted`, if any is alike; ties go to the alphabetically first."""
    best, score = None, 0.55
    for name in sorted(set(names)):
        likeness = SequenceMatcher(None, wanted, name).ratio()
        if name.rsplit("/", 1)[-1] == wanted.rsplit("/", 1)[-1]:
            likeness += 0.3
        if likeness > score:
            best, score = name, likeness
    return best


def type_name(interface: type) -> str:
    """`std_msgs/msg/String` for the class `std_msgs.msg.String`.

    Raises:
        TypeError: it is no class.
    """
    if not isinstance(interface, type):
        raise TypeError(f"{interface!r:.80} is no message class; import one, such as std_msgs.msg.String")
    package, kind = interface.__module__.split(".")[:2]
    return f"{package}/{kind}/{interface.__name__}"
