"""Services that the check offers to the student's clients."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from typing import Any

from autograder.checks.expect.expectations import Expectations
from autograder.graph.services import OfferedService


class Offering(Expectations):
    """What the check answers."""

    @cached_property
    def _offered(self) -> dict[str, OfferedService]:
        return {}

    def serve(self, name: str, srv_type: type, answer: Callable[[Any, Any], Any], delay: float = 0.0) -> OfferedService:
        """Offer a service to the student's client.

        Args:
            name: full name.
            srv_type: service class.
            answer: is given a request and a response, and returns the response.
            delay: seconds from the arrival of a request to its answer.

        Example:
            `ros.serve("/gate", Trigger, lambda request, response: response, delay=0.2)`
        """
        self._offered[name] = OfferedService(self._observer, name, srv_type, answer, delay)
        return self._offered[name]

    def requests(self, name: str) -> list[Any]:
        """Requests that have reached a service offered by `serve`.

        Args:
            name: full name.

        Example:
            `asked = len(ros.requests("/gate"))`
        """
        return list(self._offered[name].requests)

    def served(self, name: str) -> list[tuple[float, float]]:
        """When requests to a service offered by `serve` arrived and were answered.

        Args:
            name: full name.

        Returns:
            pairs, in seconds on the system clock.

        Example:
            `arrived, answered = ros.served("/gate")[-1]`
        """
        return list(self._offered[name].served)
