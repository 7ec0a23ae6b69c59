"""What is expected of the feedback about a goal: how much, how often, and what it says."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from autograder import diagnosis
from autograder.checks import outcomes
from autograder.checks.expect import rates
from autograder.checks.expect.actions import ActionExpectations, state_of
from autograder.checks.expect.expectations import WITHIN, objection
from autograder.checks.expect.facts import CONTENT
from autograder.checks.expect.rates import RATE
from autograder.checks.misuse import Misuse
from autograder.reasons import Group, Kind, Reason

if TYPE_CHECKING:
    from autograder.graph.actions import Goal

GOAL_FEEDBACK = Kind(
    "goal-feedback", "another number of feedback messages came; no reason was established", Group.STATES
)


class FeedbackExpectations(ActionExpectations):
    """What a server says of a goal while it executes it."""

    def expect_feedback(
        self,
        goal: Goal,
        *,
        at_least: int = 1,
        at_most: int | None = None,
        exactly: int | None = None,
        rate: float | None = None,
        tolerance: float = 0.3,
        values: Callable[[list[Any]], object] | None = None,
        within: float = WITHIN,
        hint: str = "",
    ) -> list[Any]:
        """Feedback about a goal arrives. What is counted is what has come when the goal ends, or in `within` seconds.

        Args:
            goal: what `send_goal` returned.
            at_least: so many messages; the wait ends with them unless `at_most` is given.
            at_most: not more, once the goal has ended.
            exactly: both at once.
            rate: hertz; judged by the median gap of the server's own stamps.
            tolerance: allowed deviation of the rate, as a share.
            values: looks at all feedback messages; a sentence that says what is wrong fails, and so does what is false.
            within: seconds until they must have come.
            hint: a pointer for the student.

        Returns:
            the feedback messages.

        Example:
            `ros.expect_feedback(goal, at_least=5, rate=10)`

        Codes:
            `no-feedback`, `goal-feedback`, `rate`, `content`, and those of `expect_result`.
        """
        if exactly is not None and (at_least != 1 or at_most is not None):
            raise Misuse("expect_feedback: exactly=… already says at_least=… and at_most=….")
        least, most = (at_least, at_most) if exactly is None else (exactly, exactly)
        number = f"at least {least}" if most is None else f"{least}" if least == most else f"{least} to {most}"
        title = f"Feedback of `{goal.name}` arrives ({number})"

        def came() -> bool:
            return goal.result is not None or (most is None and len(goal.heard) >= least)

        self.wait(came, within)
        self._observer.wait(lambda: len(goal.heard) >= least, 0.3)  # the last may be under way when the result is there
        heard = goal.heard
        if len(heard) < least or (most is not None and len(heard) > most):
            reason = self._why_not_so_much_feedback(goal, too_few=len(heard) < least)
            self._fail(title, reason, expected=number, observed=str(len(heard)), hint=hint)
        self._keep_their_rate(goal, rate, tolerance, hint)
        if values is not None:
            self._say_what_they_should(goal, values, hint)
        outcomes.passed(title, observed=str(len(heard)))
        return goal.feedback

    def _why_not_so_much_feedback(self, goal: Goal, *, too_few: bool) -> Reason:
        scene, came = self._scene(), len(goal.heard)
        said = f"{came} feedback message{'s' * (came != 1)} came; the goal is `{state_of(goal)}`."
        return (
            (diagnosis.why_no_feedback(scene, goal.name) if too_few else None)
            or (diagnosis.inside_reason(scene) if goal.result is None else None)
            or GOAL_FEEDBACK(said)
        )

    def _say_what_they_should(self, goal: Goal, values: Callable[[list[Any]], object], hint: str) -> None:
        wrong = objection(values(goal.feedback), "What the feedback says is not what was asked for.")
        if wrong:
            reason = diagnosis.why_wrong_feedback(self._scene(), goal.name) or CONTENT(wrong)
            self._fail(f"The feedback of `{goal.name}` says what it should", reason, observed=wrong, hint=hint)

    def _keep_their_rate(self, goal: Goal, rate: float | None, tolerance: float, hint: str) -> None:
        if rate is None or rates.at_rate(goal.heard, rate, tolerance):
            return
        measured = rates.in_words(goal.heard)
        reason = RATE(f"Most of the gaps between feedback messages are those of {measured}.")
        title = f"Feedback of `{goal.name}` comes at {rate:.3g} Hz"
        self._fail(title, reason, expected=f"{rate:.3g} Hz", observed=measured, hint=hint)
