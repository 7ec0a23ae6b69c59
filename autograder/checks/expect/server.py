"""`ros.server`: services that the check offers to the student's clients."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from autograder.checks.expect.expectations import WITHIN
from autograder.checks.expect.meanwhile import Meanwhile, published_during
from autograder.checks.expect.topic import Topic
from autograder.checks.misuse import Misuse
from autograder.checks.running import Running
from autograder.checks.waiting import waits_for
from autograder.graph.services import OfferedService


class Server(Meanwhile):
    """A service that the check offers, and what came of it."""

    def __init__(
        self,
        running: Running,
        name: str,
        srv_type: type | None = None,
        answer: Callable[[Any, Any], Any] | None = None,
        delay: float = 0.0,
    ) -> None:
        """Offer the service from now on, or ask about one that is offered.

        Raises:
            Misuse: nothing is offered under this name, and no answer was given.
        """
        super().__init__(running, name)
        if srv_type is not None and answer is not None:
            running.offered[name] = OfferedService(running.observer, name, srv_type, answer, delay)
        elif name not in running.offered:
            raise Misuse(f'ros.server("{name}"): the check does not offer it; give its type and an answer.')

    def requests(self) -> list[Any]:
        """Requests that have reached it so far.

        Example:
            `asked = len(ros.server("/gate").requests())`
        """
        return list(self._running.offered[self.name].requests)

    def served(self) -> list[tuple[float, float]]:
        """When requests arrived and were answered.

        Returns:
            pairs, in seconds on the system clock.

        Example:
            `arrived, answered = ros.server("/gate").served()[-1]`
        """
        return list(self._running.offered[self.name].served)

    @waits_for("messages while `{name}` is being called")
    def expect_messages_during(
        self, topic: Topic, *, at_least: int = 1, runs: int = 3, within: float = WITHIN, hint: str = ""
    ) -> None:
        """Messages go on while a node waits for an answer: from a request's arrival to its answer.

        One call with enough messages is enough: a busy machine may have stopped the whole node during another.

        Args:
            topic: whose messages are counted, by the publisher's stamps.
            at_least: messages in one call.
            runs: answered calls to look at before giving up.
            within: seconds until these must have come.
            hint: a pointer for the student.

        Example:
            `ros.server("/gate").expect_messages_during(ros.topic("/heartbeat", Int64), at_least=2)`

        Codes:
            `paused` or the cause of it, and `extra-publisher`.
        """
        self._expect_messages(
            topic,
            f"`{self.name}` is being called",
            lambda: published_during(topic, self.served()),
            at_least=at_least,
            runs=runs,
            within=within,
            hint=hint,
        )
