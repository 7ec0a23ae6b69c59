"""The two sides of a service.

`ros.service` asks whether a service is offered and what it answers; `ros.server` is a service that the check itself
offers to the student's clients.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from autograder import diagnosis
from autograder.checks import outcomes
from autograder.checks.expect.discovery import Discovery
from autograder.checks.expect.expectations import WITHIN
from autograder.checks.expect.meanwhile import Meanwhile
from autograder.checks.expect.topic import Topic
from autograder.checks.misuse import Misuse, refuse_other_class
from autograder.checks.running_launch import RunningLaunch
from autograder.checks.scoring import asked
from autograder.checks.waiting import waits_for
from autograder.graph.names import type_name
from autograder.graph.services import Answer, OfferedService, ServiceMissing, call_all

ANSWER_WITHIN = 5.0
"""Seconds that an answer may take: a local round trip takes 1 to 4 ms, a stuck node does not answer."""


class Service(Discovery):
    """A service of the student's: whether it is offered, and what it answers."""

    def __init__(self, running: RunningLaunch, name: str, srv_type: type) -> None:
        """Ask about the service of this name and class."""
        super().__init__(running, name)
        refuse_other_class(f'ros.service("{name}")', srv_type, "service")
        self._type = srv_type

    @waits_for("the service `{name}`")
    def expect(self, *, within: float = WITHIN, hint: str = "") -> None:
        """A node offers this service with this type.

        Args:
            within: seconds until it must be there.
            hint: a pointer for the student.

        Example:
            `ros.service("/add", AddTwoInts).expect()`

        Codes:
            `no-service`, `service-name`, `wrong-type`.
        """
        name, srv_type = self.name, self._type
        wanted = type_name(srv_type)
        found = self._wait_for_graph(lambda: wanted in self._observer.services().get(name, []), within)
        self._expect_that(
            found,
            f"The service `{name}` ({wanted}) is offered",
            lambda: diagnosis.why_no_service(self._scene(), name, srv_type),
            expected=f"{name} ({wanted})",
            hint=hint,
        )

    @waits_for("answers of `{name}`")
    def call_many(self, requests: Sequence[Any], *, within: float = ANSWER_WITHIN, hint: str = "") -> list[Answer]:
        """Send all requests at once; each must be answered. A missing server or answer is a failed outcome.

        Args:
            requests: of that class.
            within: seconds until every answer must have come.
            hint: a pointer for the student.

        Returns:
            the answers, in the order of the requests; `response` is what was said.

        Example:
            `answers = ros.service("/add", AddTwoInts).call_many([AddTwoInts.Request(a=n, b=1) for n in range(5)])`

        Codes:
            those of `expect`, `no-answer`, and what blocks a callback.
        """
        name, srv_type = self.name, self._type
        title = f"The service `{name}` answers"
        self._meet(lambda: name in self._observer.services(), within)
        gone = self._running.hopeless_without(lambda: name in self._observer.services())
        asked("parameter" if "/set_parameters" in name else name)
        try:
            answers = call_all(self._observer, name, srv_type, requests, within, gone)
        except ServiceMissing:
            self._fail(title, diagnosis.why_no_service(self._scene(), name, srv_type), expected=name, hint=hint)
        unanswered = sum(1 for answer in answers if answer.response is None)
        if unanswered:
            self._fail(
                title,
                diagnosis.why_no_answer(self._scene(), name),
                expected=f"an answer within {within:g} s",
                observed="no answer"
                if len(answers) == 1
                else f"{unanswered} of {len(answers)} calls without an answer",
                hint=hint,
            )
        outcomes.passed(title)
        return answers

    @waits_for("an answer of `{name}`")
    def call(self, request: Any, *, within: float = ANSWER_WITHIN, hint: str = "") -> Any:
        """Call a service of the student's; a missing server or answer is a failed outcome.

        Args:
            request: of that class.
            within: seconds until the answer must have come.
            hint: a pointer for the student.

        Returns:
            the response.

        Example:
            `total = ros.service("/add", AddTwoInts).call(AddTwoInts.Request(a=1, b=2)).sum`

        Codes:
            those of `call_many`.
        """
        return self.call_many([request], within=within, hint=hint)[0].response

    def kept_waiting(self) -> str:
        """Why it answers only after another callback of its program: a sentence, for reasons only.

        Returns:
            empty where no reason is established.

        Example:
            `because = ros.service("/get_total", GetTotal).kept_waiting() or "The answer came late."`
        """
        found = diagnosis.why_kept_waiting(self._scene(), self.name)
        return found.because if found else ""


class Server(Meanwhile):
    """A service that the check offers, and what came of it."""

    def __init__(
        self,
        running: RunningLaunch,
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
        if srv_type is not None:
            refuse_other_class(f'ros.server("{name}")', srv_type, "service")
        if srv_type is not None and answer is not None:
            running.offered[name] = OfferedService(running.observer, name, srv_type, answer, delay)
        elif name not in running.offered:
            raise Misuse(f'ros.server("{name}"): the check does not offer it; give its type and an answer.')

    def answer_after(self, delay: float) -> None:
        """Answer the requests that arrive from now on after another delay.

        Args:
            delay: seconds from the arrival of a request to its answer.

        Example:
            `ros.server("/gate").answer_after(1.5)`
        """
        self._running.offered[self.name].delay = delay

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
            self.served,
            at_least=at_least,
            runs=runs,
            within=within,
            hint=hint,
        )
