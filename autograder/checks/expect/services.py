"""Expectations of services: offered, and answered."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from autograder import diagnosis
from autograder.checks import outcomes
from autograder.checks.expect.expectations import WITHIN
from autograder.checks.expect.meeting import Meeting
from autograder.checks.parts import asked
from autograder.graph.names import type_name
from autograder.graph.services import Answer, ServiceMissing, call_all

ANSWER_WITHIN = 5.0
"""Seconds that an answer may take: a local round trip takes 1 to 4 ms, a stuck node does not answer."""


class ServiceExpectations(Meeting):
    """What must answer."""

    def expect_service(self, name: str, srv_type: type, *, within: float = WITHIN, hint: str = "") -> None:
        """A node offers this service with this type.

        Args:
            name: full name.
            srv_type: service class.
            within: seconds until it must be there.
            hint: a pointer for the student.

        Example:
            `ros.expect_service("/add", AddTwoInts)`

        Codes:
            `no-service`, `service-name`, `wrong-type`.
        """
        wanted = type_name(srv_type)
        found = self.wait_for_graph(lambda: wanted in self._observer.services().get(name, []), within)
        self._expect_that(
            found,
            f"The service `{name}` ({wanted}) is offered",
            lambda: diagnosis.why_no_service(self._scene(), name, srv_type),
            expected=f"{name} ({wanted})",
            hint=hint,
        )

    def call_many(
        self, name: str, srv_type: type, requests: Sequence[Any], *, within: float = ANSWER_WITHIN, hint: str = ""
    ) -> list[Answer]:
        """Send all requests at once; each must be answered. A missing server or answer is a failed outcome.

        Args:
            name: full name.
            srv_type: service class.
            requests: of that class.
            within: seconds until every answer must have come.
            hint: a pointer for the student.

        Returns:
            the answers, in the order of the requests; `response` is what was said.

        Example:
            `answers = ros.call_many("/add", AddTwoInts, [AddTwoInts.Request(a=1, b=2), AddTwoInts.Request(a=3, b=4)])`

        Codes:
            those of `expect_service`, `no-answer`, and what blocks a callback.
        """
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

    def call(self, name: str, srv_type: type, request: Any, *, within: float = ANSWER_WITHIN, hint: str = "") -> Any:
        """Call a service of the student's; a missing server or answer is a failed outcome.

        Args:
            name: full name.
            srv_type: service class.
            request: of that class.
            within: seconds until the answer must have come.
            hint: a pointer for the student.

        Returns:
            the response.

        Example:
            `total = ros.call("/add", AddTwoInts, AddTwoInts.Request(a=1, b=2)).sum`

        Codes:
            those of `call_many`.
        """
        return self.call_many(name, srv_type, [request], within=within, hint=hint)[0].response
