"""Expectations of names: nodes and topics."""

from __future__ import annotations

from autograder import diagnosis
from autograder.checks import outcomes
from autograder.checks.expect.expectations import WITHIN
from autograder.checks.expect.meeting import MATCHES_WITHIN, Meeting
from autograder.checks.running import SETTLE
from autograder.graph.names import type_name
from autograder.reasons import Group, Kind

NODE_PRESENT = Kind("node-present", "a node is on the graph that should have gone", Group.ENDS)

GONE_WITHIN = 2.0
"""Seconds that an absence may take to show, for example after a node was stopped."""


class GraphExpectations(Meeting):
    """What must be on the graph, and what must not."""

    def expect_node(self, name: str, *, within: float = WITHIN, hint: str = "") -> None:
        """The node with this full name is on the graph, exactly once, and lives on.

        Args:
            name: full name.
            within: seconds until it must be there.
            hint: a pointer for the student.

        Example:
            `ros.expect_node("/robot/talker")`

        Codes:
            `no-node`, `node-name`, `namespace`, `one-name-for-all`, `duplicate-node`, and those of a program that
            ended.
        """
        title = f"The node `{name}` is on the graph"
        if not self.wait_for_graph(lambda: name in self._observer.nodes(), within):
            self._fail(
                title,
                diagnosis.why_no_node(self._scene(), name),
                expected=name,
                observed=", ".join(self._observer.nodes()) or "no node",
                hint=hint,
            )
        self._settle(name)
        if name not in self._observer.nodes() or self._running.gone_program():
            # A program that dies takes its node off the graph first and prints its traceback after that.
            self._observer.wait(self._running.gone_program, SETTLE)
            self._fail(
                title,
                diagnosis.why_no_node(self._scene(), name),
                expected=name,
                observed="it was there, and went away",
                hint=hint,
            )
        self._observer.wait(lambda: self._observer.nodes().count(name) >= self._made(name), MATCHES_WITHIN)
        if self._observer.nodes().count(name) > 1:
            self._fail(
                title,
                diagnosis.why_doubled(self._scene(), name),
                expected="one node of this name",
                observed=", ".join(self._observer.nodes()),
                hint=hint,
            )
        outcomes.passed(title, observed=name)

    def expect_no_node(self, name: str, *, within: float = GONE_WITHIN, hint: str = "") -> None:
        """No node has this full name; use it after a positive expectation, which proves that the graph is known.

        Args:
            name: full name.
            within: seconds until it must be gone.
            hint: a pointer for the student.

        Example:
            `ros.expect_no_node("/talker")`

        Codes:
            `node-present`.
        """
        gone = self._observer.wait(lambda: name not in self._observer.nodes(), within)
        self._expect_that(
            gone,
            f"No node is called `{name}`",
            lambda: NODE_PRESENT(f"`{name}` is still on the graph."),
            observed=", ".join(self._observer.nodes()),
            hint=hint,
        )

    def expect_topic(self, topic: str, msg_type: type, *, within: float = WITHIN, hint: str = "") -> None:
        """The topic exists with this message type.

        Args:
            topic: full name.
            msg_type: message class.
            within: seconds until it must be there.
            hint: a pointer for the student.

        Example:
            `ros.expect_topic("/chatter", String)`

        Codes:
            `no-topic`, `topic-name`, `wrong-type`, `wrong-end`, `absolute-name`.
        """
        wanted = type_name(msg_type)
        found = self.wait_for_graph(lambda: wanted in self._observer.topics().get(topic, []), within)
        self._expect_that(
            found,
            f"The topic `{topic}` carries {wanted}",
            lambda: diagnosis.why_no_endpoint(self._scene(), topic, msg_type, "publisher"),
            expected=f"{topic} ({wanted})",
            observed=self._topics,
            hint=hint,
        )

    def expect_no_topic(self, topic: str, *, within: float = GONE_WITHIN, hint: str = "") -> None:
        """Nobody publishes or subscribes to this topic.

        Args:
            topic: full name.
            within: seconds until nobody may use it any more.
            hint: a pointer for the student.

        Example:
            `ros.expect_no_topic("/chatter")`

        Codes:
            `topic-present`, `absolute-name`.
        """
        gone = self._observer.wait(lambda: topic not in self._observer.topics(), within)
        self._expect_that(
            gone,
            f"Nobody uses the topic `{topic}`",
            lambda: diagnosis.why_topic_present(self._scene(), topic),
            observed=self._topics,
            hint=hint,
        )

    def _topics(self) -> str:
        own = [t for t in sorted(self._observer.topics()) if t not in ("/rosout", "/parameter_events")]
        return ", ".join(own) or "no topic"
