"""Goals that the check sends to the student's action servers."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING, Any

from autograder import diagnosis
from autograder.checks import outcomes
from autograder.checks.expect.expectations import WITHIN
from autograder.checks.expect.meeting import Meeting
from autograder.checks.message_text import set_fields
from autograder.checks.misuse import Misuse
from autograder.graph.services import ServiceMissing
from autograder.reasons import Group, Kind

if TYPE_CHECKING:
    from autograder.graph.actions import ActionSeen, Goal

GOAL_ACCEPTED = Kind("goal-accepted", "a goal was accepted that should be rejected", Group.STATES)
GOAL_STATUS = Kind("goal-status", "a goal ended with another status; no reason was established", Group.STATES)
GOAL_REJECTED = Kind(
    "goal-rejected", "a goal was rejected that should be accepted; no reason was established", Group.STATES
)
GOAL_UNFINISHED = Kind("goal-unfinished", "a goal did not end in the time; no reason was established", Group.STATES)
CANCEL_REFUSED = Kind("cancel-refused", "the server did not agree to cancel; no reason was established", Group.STATES)
CANCEL_LATE = Kind("cancel-late", "the server went on too long after it had agreed to cancel", Group.STATES)
GOALS_TOGETHER = Kind("goals-together", "the status topic showed two goals that were executed at once", Group.STATES)

_STEPS = 3
"""Feedback messages after which a server that has agreed to cancel must have ended the goal: 0.3 s at 10 Hz."""


class ActionExpectations(Meeting):
    """What decides about goals, and what becomes of them."""

    @cached_property
    def _actions(self) -> dict[str, ActionSeen]:
        return {}

    def _action(self, name: str, action_type: type) -> ActionSeen:
        # Actions load numpy, a quarter of a second of CPU that most labs do not need.
        from autograder.graph.actions import ActionSeen

        if name not in self._actions:
            self._actions[name] = ActionSeen(self._observer, name, action_type)
        return self._actions[name]

    def send_goal(
        self,
        name: str,
        action_type: type,
        goal: Any,
        *,
        accepted: bool | None = None,
        within: float = WITHIN,
        hint: str = "",
    ) -> Goal:
        """Send a goal and wait for the server's decision; a missing server or decision is a failed outcome.

        Args:
            name: full name of the action.
            action_type: action class.
            goal: of that class.
            accepted: how the server must decide; by default it may do either.
            within: seconds until it must be accepted or rejected.
            hint: a pointer for the student.

        Returns:
            the goal, to be followed: feedback, status, result.

        Example:
            `goal = ros.send_goal("/dock", Fibonacci, Fibonacci.Goal(order=5), accepted=True)`

        Codes:
            `no-action`, `action-name`, `wrong-type`, `no-answer`, `goal-return`, `goal-rejected`, `goal-accepted`, and
            what blocks a callback.
        """
        from autograder.graph.actions import send_goal

        title = f"The action `{name}` decides about a goal"
        action = self._action(name, action_type)  # what it listens to is there before the nodes are asked
        self._meet(lambda: self._offered_action(name), within)
        try:
            gone = self._running.hopeless_without(lambda: self._offered_action(name))
            sent = send_goal(self._observer, action, goal, within, gone)
        except ServiceMissing:
            self._fail(title, diagnosis.why_no_action(self._scene(), name, action_type), expected=name, hint=hint)
        if sent.accepted is None:
            scene = self._scene()
            waits = diagnosis.program_trouble(scene) or diagnosis.why_waits_for_a_goal(scene, name)
            waits = waits or diagnosis.why_no_answer(scene, name)
            self._fail(title, waits, expected="accepted or rejected", observed="no answer", hint=hint)
        observed = "accepted" if sent.accepted else "rejected"
        if accepted is None or accepted == sent.accepted:
            outcomes.passed(title, observed=observed)
            return sent
        if accepted:
            because = f"The server rejected a goal that it should accept: {set_fields(goal)}."
            reason = diagnosis.why_rejected(self._scene(), name) or GOAL_REJECTED(because)
            title = f"The action `{name}` accepts the goal"
            self._fail(title, reason, expected="accepted", observed=observed, hint=hint)
        reason = GOAL_ACCEPTED(f"The server accepted a goal that it should reject: {set_fields(goal)}.")
        self._fail(f"The action `{name}` rejects the goal", reason, expected="rejected", observed=observed, hint=hint)

    def _offered_action(self, name: str) -> bool:
        return f"{name}/_action/send_goal" in self._observer.services()

    def expect_result(self, goal: Goal, *, status: str = "succeeded", within: float = WITHIN, hint: str = "") -> Any:
        """A goal ends, with this status.

        Args:
            goal: what `send_goal` returned.
            status: `succeeded`, `aborted` or `canceled`.
            within: seconds until it must have ended.
            hint: a pointer for the student.

        Returns:
            the result message.

        Example:
            `sequence = ros.expect_result(goal).sequence`

        Codes:
            `execute-exception`, `no-succeed`, `execute-return`, `message-field`, `goal-status`, `goal-unfinished`, and
            what blocks a callback.
        """
        title = f"The goal of `{goal.name}` ends as `{status}`"
        goal.wait_for_result(within)
        if goal.status == status and goal.result is not None:
            outcomes.passed(title, observed=goal.status)
            return goal.result
        scene = self._scene()
        if goal.result is None:
            because, advice = _unfinished(goal, within)
            reason = (
                diagnosis.why_not_finished(scene, goal.name, status)
                or diagnosis.program_trouble(scene)
                or diagnosis.inside_reason(scene)
                or GOAL_UNFINISHED(because, advice)
            )
            self._fail(title, reason, expected=status, observed="no end", hint=hint)
        found = diagnosis.why_not_finished(scene, goal.name, status) if goal.status == "aborted" else None
        because, advice = f"It ended as `{goal.status}`.", ""
        if goal.agreed:
            because = f"The server had accepted the request to cancel, but the goal ended as `{goal.status}`."
            advice = "While `is_cancel_requested` is true, end the goal only with `canceled()`."
        found = found or GOAL_STATUS(because, advice)
        self._fail(title, found, expected=status, observed=goal.status, hint=hint)

    def expect_canceled(self, goal: Goal, *, within: float = 3.0, hint: str = "") -> Any:
        """Ask the server to cancel a goal: it agrees, and soon ends the goal as `canceled`.

        How soon is counted in the server's own steps, so that a slow machine makes no difference: after its status
        message that says `canceling`, at most three more feedback messages may come. For a server that gives feedback
        ten times a second that is 0.3 s.

        Args:
            goal: what `send_goal` returned.
            within: seconds until it must have agreed, and again until the goal must have ended. The goal must take
                longer than that by itself.
            hint: a pointer for the student.

        Returns:
            the result message.

        Example:
            `where = ros.expect_canceled(goal).sequence`

        Codes:
            `cancel-refused`, `no-cancel-callback`, `cancel-return`, `goal-holds-thread`, `goal-holds-group`,
            `cancel-late`, and those of `expect_result`.
        """
        title = f"`{goal.name}` agrees to cancel the goal"
        goal.cancel(within)
        if not goal.agreed:
            scene = self._scene()
            said = "It refused." if goal.agreed is False else f"No answer came within {within:g} s."
            said += f" The goal had ended as `{goal.status}` meanwhile." if goal.result is not None else ""
            reason = (
                diagnosis.why_not_canceled(scene, goal.name)
                or (diagnosis.why_not_finished(scene, goal.name, "canceled") if goal.status == "aborted" else None)
                or diagnosis.program_trouble(scene)
                or diagnosis.inside_reason(scene)
                or CANCEL_REFUSED(said)
            )
            self._fail(title, reason, expected="agreed", observed=said, hint=hint)
        outcomes.passed(title, observed="agreed")
        result = self.expect_result(goal, status="canceled", within=within, hint=hint)
        when = {change.status: change.stamp for change in goal.changes}
        began, ended = when.get("canceling"), when.get("canceled")
        after = [heard for heard in goal.heard if began is not None and heard.stamp > began]
        taken = f" ({ended - began:.2f} s)" if began is not None and ended is not None else ""
        because = f"After the server had accepted the request to cancel, it sent {len(after)} more feedback messages"
        because += f"{taken}."
        self._expect_that(
            len(after) <= _STEPS,
            f"`{goal.name}` ends a goal soon after it has agreed to cancel it",
            lambda: CANCEL_LATE(because),
            expected=f"at most {_STEPS} more feedback messages",
            observed=f"{len(after)}{taken}",
            hint=hint,
        )
        return result

    def expect_one_at_a_time(self, name: str, *, hint: str = "") -> None:
        """The server never executed two goals at once, by all status messages that it has published so far.

        Args:
            name: full name of an action to which goals were sent.
            hint: a pointer for the student.

        Example:
            `ros.expect_one_at_a_time("/dock")`

        Codes:
            `goals-together`.
        """
        if name not in self._actions:
            raise Misuse(f"expect_one_at_a_time: no goal was sent to {name!r} before.")
        most = self._actions[name].most_at_once()
        because = f"A status message of `{name}` shows {most} goals that are being executed."
        self._expect_that(
            most <= 1,
            f"`{name}` never executes two goals at once",
            lambda: GOALS_TOGETHER(because),
            expected="1",
            observed=str(most),
            hint=hint,
        )


def _unfinished(goal: Goal, within: float) -> tuple[str, str]:
    """Say of a goal without a result how far it has got, and what to do."""
    state = state_of(goal)
    because = f"The goal is `{state}`, and it has not ended within {within:g} s."
    if state in ("succeeded", "canceled", "aborted"):
        because = f"The status of the goal is `{state}`, but its execute callback has not returned a result."
        return because, "When its goal has ended, the execute callback has to `return`."
    if state == "accepted":
        hint = "`execute()` of its goal handle has not been called yet: otherwise, the status would be `executing`."
        return because, hint
    hint = "The server accepted the request to cancel. Now the execute callback has to check `is_cancel_requested`."
    return because, hint if goal.agreed else ""


def state_of(goal: Goal) -> str:
    """The goal's status by the last that is known of it."""
    changes = goal.changes
    return goal.status if goal.result is not None or not changes else changes[-1].status
