"""`ros.action`: goals that the check sends to the student's action servers."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from autograder import diagnosis
from autograder.checks import outcomes
from autograder.checks.expect.discovery import Discovery
from autograder.checks.expect.expectations import WITHIN
from autograder.checks.message_text import set_fields, shorten
from autograder.checks.misuse import Misuse, refuse_other_class
from autograder.checks.running_launch import RunningLaunch
from autograder.checks.waiting import waits_for
from autograder.graph.services import ServiceMissing
from autograder.reasons import Group, Kind

if TYPE_CHECKING:
    from autograder.checks.expect.goal import SentGoal

GOAL_ACCEPTED = Kind("goal-accepted", "a goal was accepted that should be rejected", Group.STATES)
GOAL_REJECTED = Kind(
    "goal-rejected", "a goal was rejected that should be accepted; no reason was established", Group.STATES
)
GOALS_TOGETHER = Kind("goals-together", "the status topic showed two goals that were executed at once", Group.STATES)


class Action(Discovery):
    """An action of the student's: what its server decides about goals."""

    def __init__(self, running: RunningLaunch, name: str, action_type: type) -> None:
        """Ask about the action of this name and class."""
        super().__init__(running, name)
        refuse_other_class(f'ros.action("{name}")', action_type, "action")
        self._type = action_type

    @waits_for("the action `{name}`")
    def send_goal(
        self,
        goal: Any,
        *,
        accepted: bool | None = None,
        within: float = WITHIN,
        hint: str = "",
    ) -> SentGoal:
        """Send a goal and wait for the server's decision; a missing server or decision is a failed outcome.

        Args:
            goal: of that class.
            accepted: how the server must decide; by default it may do either.
            within: seconds until it must be accepted or rejected.
            hint: a pointer for the student.

        Returns:
            the goal, to be followed: feedback, status, result.

        Example:
            `goal = ros.action("/dock", Fibonacci).send_goal(Fibonacci.Goal(order=5), accepted=True)`

        Codes:
            `no-action`, `action-name`, `wrong-type`, `no-answer`, `goal-return`, `goal-rejected`, `goal-accepted`, and
            what blocks a callback.
        """
        name, action_type = self.name, self._type
        # Actions load numpy, a quarter of a second of CPU that most labs do not need.
        from autograder.checks.expect.goal import SentGoal
        from autograder.graph.actions import ActionSeen, send_goal

        title = f"The action `{name}` decides about a goal"
        if name not in self._running.actions:
            self._running.actions[name] = ActionSeen(self._observer, name, action_type)
        action = self._running.actions[name]  # what it listens to is there before the nodes are asked
        self._meet(lambda: self._offered(), within)
        try:
            gone = self._running.hopeless_without(lambda: self._offered())
            sent = SentGoal(self._running, send_goal(self._observer, action, goal, within, gone))
        except ServiceMissing:
            self._fail(title, diagnosis.why_no_action(self._scene(), name, action_type), expected=name, hint=hint)
        if sent.accepted is None:
            scene = self._scene()
            waits = diagnosis.program_trouble(scene) or diagnosis.why_waits_for_a_goal(scene, name)
            waits = waits or diagnosis.why_no_answer(scene, name)
            self._fail(title, waits, expected="accepted or rejected", observed="no answer", hint=hint)
        observed = "accepted" if sent.accepted else "rejected"
        if accepted is None or accepted == sent.accepted:
            # The goal is named, so that goals that differ count as different expectations.
            outcomes.passed(
                f"The action `{name}` decides about the goal `{shorten(set_fields(goal))}`", observed=observed
            )
            return sent
        if accepted:
            because = f"The server rejected a goal that it should accept: {set_fields(goal)}."
            reason = diagnosis.why_rejected(self._scene(), name) or GOAL_REJECTED(because)
            title = f"The action `{name}` accepts the goal"
            self._fail(title, reason, expected="accepted", observed=observed, hint=hint)
        reason = GOAL_ACCEPTED(f"The server accepted a goal that it should reject: {set_fields(goal)}.")
        self._fail(f"The action `{name}` rejects the goal", reason, expected="rejected", observed=observed, hint=hint)

    def _offered(self) -> bool:
        return f"{self.name}/_action/send_goal" in self._observer.services()

    def expect_one_at_a_time(self, *, hint: str = "") -> None:
        """The server never executed two goals at once, by all status messages that it has published so far.

        Args:
            hint: a pointer for the student.

        Example:
            `ros.action("/dock", Fibonacci).expect_one_at_a_time()`

        Codes:
            `goals-together`.
        """
        name = self.name
        if name not in self._running.actions:
            raise Misuse(f"expect_one_at_a_time: no goal was sent to {name!r} before.")
        most = self._running.actions[name].most_at_once()
        because = f"A status message of `{name}` shows {most} goals that are being executed."
        self._expect_that(
            most <= 1,
            f"`{name}` never executes two goals at once",
            lambda: GOALS_TOGETHER(because),
            expected="1",
            observed=str(most),
            hint=hint,
        )
