"""Goals that the check sends to the student's action servers."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from autograder import diagnosis
from autograder.checks import outcomes
from autograder.checks.expect.expectations import WITHIN
from autograder.checks.expect.meeting import Meeting
from autograder.diagnosis import Diagnosis
from autograder.graph.services import ServiceMissing

if TYPE_CHECKING:
    from autograder.graph.actions import Goal


class ActionExpectations(Meeting):
    """What decides about goals."""

    def send_goal(self, name: str, action_type: type, goal: Any, *, within: float = WITHIN, hint: str = "") -> Goal:
        """Send a goal and wait for the server's decision; a missing server or decision is a failed outcome.

        Args:
            name: full name of the action.
            action_type: action class.
            goal: of that class.
            within: seconds until it must be accepted or rejected.
            hint: a pointer for the student.

        Returns:
            the goal, to be followed: feedback, status, result.

        Example:
            `goal = ros.send_goal("/dock", Fibonacci, Fibonacci.Goal(order=5))`

        Codes:
            `no-action`, `no-answer`, and what blocks a callback.
        """
        # Actions load numpy, a quarter of a second of CPU that most labs do not need.
        from autograder.graph import actions

        title = f"The action `{name}` decides about a goal"
        self._meet(lambda: f"{name}/_action/send_goal" in self._observer.services(), within)
        try:
            sent = actions.send_goal(self._observer, name, action_type, goal, within, self._running.all_ended)
        except ServiceMissing:
            self._fail(
                title,
                diagnosis.program_trouble(self._scene())
                or Diagnosis(f"No node offers the action `{name}`.", "no-action"),
                expected=name,
                hint=hint,
            )
        if sent.accepted is None:
            self._fail(title, diagnosis.why_no_answer(self._scene(), name), expected="accepted or rejected", hint=hint)
        outcomes.passed(title, observed="accepted" if sent.accepted else "rejected")
        return sent
