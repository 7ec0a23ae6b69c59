"""Looking at the launch: what is on its graph, and what its programs print. Nothing here is an outcome."""

from __future__ import annotations

from rclpy.topic_endpoint_info import TopicEndpointInfo

from autograder import diagnosis
from autograder.checks.expect.expectations import Expectations
from autograder.checks.misuse import Misuse
from autograder.checks.program import Program


class Looking(Expectations):
    """What there is to see, at this moment."""

    def nodes(self) -> list[str]:
        """Full names of the nodes on the graph now; two nodes of one name are listed twice.

        Example:
            `ros.wait(lambda: "/talker" in ros.nodes())`
        """
        return self._observer.nodes()

    def topics(self) -> dict[str, list[str]]:
        """Topics on the graph now, each with the names of its message types.

        Example:
            `images = [topic for topic, types in ros.topics().items() if "sensor_msgs/msg/Image" in types]`
        """
        return self._observer.topics()

    def publishers(self, topic: str) -> list[TopicEndpointInfo]:
        """Publishers of a topic now, those of the check left out.

        Args:
            topic: full name.

        Example:
            `names = [end.node_name for end in ros.publishers("/chatter")]`
        """
        return self._observer.publishers(topic)

    def subscriptions(self, topic: str) -> list[TopicEndpointInfo]:
        """Subscriptions to a topic now, those of the check left out.

        Args:
            topic: full name.

        Example:
            `depths = [end.qos_profile.deadline for end in ros.subscriptions("/chatter")]`
        """
        return self._observer.subscriptions(topic)

    def programs(self) -> list[str]:
        """Names of the programs that this launch has started so far, ended ones included.

        Example:
            `ros.require(ros.programs(), "The words start the camera")`
        """
        return [program.name for _, program in self._running.programs]

    def descriptions(self) -> list[Program]:
        """What this launch was asked to start, or what its launch file starts: programs with their arguments.

        Example:
            `starts = len(ros.descriptions())`
        """
        return list(self._running.described)

    def pause(self, for_seconds: float) -> None:
        """Let the programs run for exactly so long: for experiments in which the length of a time matters.

        Args:
            for_seconds: how long, in seconds. To wait for something, use `wait` or an expectation.

        Example:
            `ros.pause(0.5)`
        """
        if for_seconds < 0:
            raise Misuse(f"pause: {for_seconds!r} is no time; it is a number of seconds, 0 or more.")
        self._observer.pause(for_seconds)

    def seen_runs(self, program: str, kind: str, name: str) -> int | None:
        """How often a callback was seen to begin inside a program: evidence for reasons only.

        Args:
            program: its name.
            kind: `subscription` or `service`.
            name: full name of its topic or service.

        Returns:
            None where the inside of the program cannot be seen.

        Example:
            `runs = ros.seen_runs("recorder", "subscription", "/frames")`
        """
        things = [t for inside in self._scene().insides if inside.name == program for t in inside.callbacks]
        return next((thing.runs for thing in things if (thing.kind, thing.name) == (kind, name)), None)

    def account(self, topic: str) -> str:
        """What was seen of a topic's publisher, of the callbacks of its node and of its messages: for reasons only.

        Args:
            topic: full name.

        Example:
            `ros.require(heard, "The status goes on", because=f"Nothing came. {ros.account('/status')}")`
        """
        return diagnosis.account(self._scene(), topic)

    def kept_waiting(self, service: str) -> str:
        """Why a service answers only after another callback of its program: a sentence, for reasons only.

        Args:
            service: full name.

        Returns:
            empty where no reason is established.

        Example:
            `because = ros.kept_waiting("/get_total") or "The answer came late."`
        """
        found = diagnosis.why_kept_waiting(self._scene(), service)
        return found.because if found else ""
