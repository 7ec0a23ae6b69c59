"""`ros.graph`: what is on the graph at this moment. Nothing here is an outcome."""

from __future__ import annotations

from collections.abc import Callable

from rclpy.topic_endpoint_info import TopicEndpointInfo

from autograder.checks.expect.expectations import WITHIN, Expectations
from autograder.checks.waiting import waits_for


class Graph(Expectations):
    """The ROS graph, without what the check itself puts on it."""

    def nodes(self) -> list[str]:
        """Full names of the nodes on the graph now; two nodes of one name are listed twice.

        Example:
            `ros.wait(lambda: "/talker" in ros.graph.nodes())`
        """
        return self._observer.nodes()

    def topics(self) -> dict[str, list[str]]:
        """Topics on the graph now, each with the names of its message types.

        Example:
            `images = [topic for topic, types in ros.graph.topics().items() if "sensor_msgs/msg/Image" in types]`
        """
        return self._observer.topics()

    def publishers(self, topic: str) -> list[TopicEndpointInfo]:
        """Publishers of a topic now.

        Args:
            topic: full name.

        Example:
            `names = [end.node_name for end in ros.graph.publishers("/chatter")]`
        """
        return self._observer.publishers(topic)

    def subscriptions(self, topic: str) -> list[TopicEndpointInfo]:
        """Subscriptions to a topic now.

        Args:
            topic: full name.

        Example:
            `depths = [end.qos_profile.deadline for end in ros.graph.subscriptions("/chatter")]`
        """
        return self._observer.subscriptions(topic)

    @waits_for("what `ros.graph.wait` asks for")
    def wait(self, ready: Callable[[], object], within: float = WITHIN) -> bool:
        """Wait for something on the graph, and tell whether it is there: this records no outcome.

        Args:
            ready: what is waited for, such as a node or a publisher.
            within: seconds until it must have come. The wait ends earlier once nothing new appears on the graph.

        Example:
            `ros.graph.wait(lambda: len(ros.graph.nodes()) >= 2)`
        """
        return self._wait_for_graph(ready, within)
