"""A goal that the check has sent: its feedback, how it ends, and that it can be canceled."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from autograder import diagnosis
from autograder.checks import outcomes
from autograder.checks.expect import rates
from autograder.checks.expect.expectations import WITHIN, objection
from autograder.checks.expect.meanwhile import Meanwhile, published_during
from autograder.checks.expect.rates import RATE
from autograder.checks.expect.topic import CONTENT, Topic
from autograder.checks.misuse import Misuse
from autograder.checks.running_launch import RunningLaunch
from autograder.checks.waiting import waits_for
from autograder.graph.actions import Change, Goal
from autograder.graph.recording import Received
from autograder.reasons import Group, Kind, Reason

GOAL_STATUS = Kind("goal-status", "a goal ended with another status; no reason was established", Group.STATES)
GOAL_UNFINISHED = Kind("goal-unfinished", "a goal did not end in the time; no reason was established", Group.STATES)
CANCEL_REFUSED = Kind("cancel-refused", "the server did not agree to cancel; no reason was established", Group.STATES)
CANCEL_LATE = Kind("cancel-late", "the server went on too long after it had agreed to cancel", Group.STATES)
GOAL_FEEDBACK = Kind(
    "goal-feedback", "another number of feedback messages came; no reason was established", Group.STATES
)

_UNDER_WAY = 1.0
"""Seconds for which feedback may still be under way when the result is there: they come by different ways."""

_RATE_DECIDED = 3
"""A rate that is not right before is judged after so many times the messages asked for, or at the end of the goal."""

_STEPS = 3
"""Feedback messages after which a server that has agreed to cancel must have ended the goal: 0.3 s at 10 Hz."""


class SentGoal(Meanwhile):
    """A goal that the check has sent, and what the server has said about it so far."""

    def __init__(self, running: RunningLaunch, seen: Goal) -> None:
        """Follow this goal."""
        super().__init__(running, seen.name)
        self.seen = seen

    @property
    def _this(self) -> str:
        # The goals of one action are told apart: each is another expectation.
        return "the goal" if self.seen.number == 1 else f"goal {self.seen.number}"

    @property
    def accepted(self) -> bool | None:
        """Whether the server accepted it; None until it has answered."""
        return self.seen.accepted

    @property
    def status(self) -> str:
        """How it ended, or what came of the request: `succeeded`, `aborted`, `canceled`, `accepted` or `unknown`."""
        return self.seen.status

    @property
    def result(self) -> Any | None:
        """The result message; None until the goal has ended."""
        return self.seen.result

    @property
    def heard(self) -> list[Received]:
        """Its feedback in the order of publishing, with stamps; `msg.feedback` is the message."""
        return self.seen.heard

    @property
    def feedback(self) -> list[Any]:
        """Its feedback messages in the order of publishing."""
        return self.seen.feedback

    @property
    def changes(self) -> list[Change]:
        """The statuses that it went through, each with its time, as its server published them."""
        return self.seen.changes

    def wait_for_feedback(self, count: int, within: float = WITHIN) -> bool:
        """Wait until at least `count` feedback messages are there; whether they came within `within` seconds."""
        return self.seen.wait_for_feedback(count, within)

    def wait_for_result(self, within: float = WITHIN) -> bool:
        """Wait until the goal has ended; whether it did within `within` seconds."""
        return self.seen.wait_for_result(within)

    def cancel(self, within: float = 5.0) -> bool:
        """Ask the server to cancel it; whether the server agreed within `within` seconds. The goal then still runs."""
        return self.seen.cancel(within)

    @waits_for("the end of a goal of `{name}`")
    def expect_result(self, *, status: str = "succeeded", within: float = WITHIN, hint: str = "") -> Any:
        """A goal ends, with this status.

        Args:
            status: `succeeded`, `aborted` or `canceled`.
            within: seconds until it must have ended.
            hint: a pointer for the student.

        Returns:
            the result message.

        Example:
            `sequence = goal.expect_result().sequence`

        Codes:
            `execute-exception`, `no-succeed`, `execute-return`, `message-field`, `goal-status`, `goal-unfinished`, and
            what blocks a callback.
        """
        goal = self.seen
        title = f"{self._this.capitalize()} of `{goal.name}` ends as `{status}`"
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

    @waits_for("the end of a goal of `{name}`")
    def expect_canceled(self, *, within: float = 3.0, hint: str = "") -> Any:
        """Ask the server to cancel a goal: it agrees, and soon ends the goal as `canceled`.

        How soon is counted in the server's own steps, so that a slow machine makes no difference: after its status
        message that says `canceling`, at most three more feedback messages may come. For a server that gives feedback
        ten times a second that is 0.3 s.

        Args:
            within: seconds until it must have agreed, and again until the goal must have ended. The goal must take
                longer than that by itself.
            hint: a pointer for the student.

        Returns:
            the result message.

        Example:
            `where = goal.expect_canceled().sequence`

        Codes:
            `cancel-refused`, `no-cancel-callback`, `cancel-return`, `goal-holds-thread`, `goal-holds-group`,
            `cancel-late`, and those of `expect_result`.
        """
        goal = self.seen
        title = f"`{goal.name}` agrees to cancel {self._this}"
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
        result = self.expect_result(status="canceled", within=within, hint=hint)
        when = {change.status: change.stamp for change in goal.changes}
        began, ended = when.get("canceling"), when.get("canceled")
        after = [heard for heard in goal.heard if began is not None and heard.stamp > began]
        taken = f" ({ended - began:.2f} s)" if began is not None and ended is not None else ""
        because = f"After the server had accepted the request to cancel, it sent {len(after)} more feedback messages"
        because += f"{taken}."
        self._expect_that(
            len(after) <= _STEPS,
            f"`{goal.name}` ends {self._this} soon after it has agreed to cancel it",
            lambda: CANCEL_LATE(because),
            expected=f"at most {_STEPS} more feedback messages",
            observed=f"{len(after)}{taken}",
            hint=hint,
        )
        return result

    @waits_for("feedback about a goal of `{name}`")
    def expect_feedback(
        self,
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
            `goal.expect_feedback(at_least=5, rate=10)`

        Codes:
            `no-feedback`, `goal-feedback`, `rate`, `content`, and those of `expect_result`.
        """
        goal = self.seen
        if exactly is not None and (at_least != 1 or at_most is not None):
            raise Misuse("expect_feedback: exactly=… already says at_least=… and at_most=….")
        least, most = (at_least, at_most) if exactly is None else (exactly, exactly)
        number = f"at least {least}" if most is None else f"{least}" if least == most else f"{least} to {most}"
        title = f"Feedback about {self._this} of `{goal.name}` arrives ({number})"

        def came() -> bool:
            return goal.result is not None or (most is None and len(goal.heard) >= least)

        self._wait(came, within)
        self._observer.wait(lambda: len(goal.heard) >= least, _UNDER_WAY)
        heard = goal.heard
        if len(heard) < least or (most is not None and len(heard) > most):
            reason = self._why_not_so_much_feedback(too_few=len(heard) < least)
            self._fail(title, reason, expected=number, observed=str(len(heard)), hint=hint)
        self._keep_their_rate(rate, tolerance, max(least, 2), hint)
        if values is not None:
            self._say_what_they_should(values, hint)
        outcomes.passed(title, observed=str(len(heard)))
        return goal.feedback

    def _why_not_so_much_feedback(self, *, too_few: bool) -> Reason:
        goal = self.seen
        scene, came = self._scene(), len(goal.heard)
        said = f"{came} feedback message{'s' * (came != 1)} came; the goal is `{_state_of(goal)}`."
        return (
            (diagnosis.why_no_feedback(scene, goal.name) if too_few else None)
            or (diagnosis.inside_reason(scene) if goal.result is None else None)
            or GOAL_FEEDBACK(said)
        )

    def _say_what_they_should(self, values: Callable[[list[Any]], object], hint: str) -> None:
        goal = self.seen

        def wrong_now() -> str:
            return objection(values(goal.feedback), "What the feedback says is not what was asked for.")

        if goal.result is not None:
            self._observer.wait(lambda: not wrong_now(), _UNDER_WAY)
        if wrong := wrong_now():
            reason = diagnosis.why_wrong_feedback(self._scene(), goal.name) or CONTENT(wrong)
            title = f"The feedback about {self._this} of `{goal.name}` says what it should"
            self._fail(title, reason, observed=wrong, hint=hint)

    def _keep_their_rate(self, rate: float | None, tolerance: float, need: int, hint: str) -> None:
        goal = self.seen
        if rate is None or rates.at_rate(goal.heard, rate, tolerance):
            return
        if goal.result is None and len(goal.heard) < _RATE_DECIDED * need:
            # What a busy machine held up for a moment comes at its rate again; what has another rate never does.
            def right() -> bool:
                return rates.at_rate(goal.heard[-need:], rate, tolerance)

            def over() -> bool:
                return goal.result is not None or len(goal.heard) >= _RATE_DECIDED * need

            self._wait(lambda: right() or over(), WITHIN)
            if right():
                return
        if rates.too_slow(goal.heard, rate):
            gap, allowed = rates.median_gap(goal.heard), (1 + tolerance) / rate
            self._observer.patience.was_slow(goal.heard[0].received, gap, allowed)
        measured = rates.in_words(goal.heard)
        came = measured if measured == "all at once" else f"at {measured}"
        reason = RATE(f"The feedback messages come {came} instead of {rate:.3g} Hz.")
        title = f"Feedback about {self._this} of `{goal.name}` comes at {rate:.3g} Hz"
        self._fail(title, reason, expected=f"{rate:.3g} Hz", observed=measured, hint=hint)

    def messages_during(self, topic: Topic) -> list[int]:
        """How many messages were published while it was executed: from `executing` to its last status.

        Args:
            topic: whose messages are counted, by the publisher's stamps.

        Returns:
            one number once it has ended; nothing before.

        Example:
            `counts = goal.messages_during(ros.topic("/ticks", Int64))`
        """
        return published_during(topic, self._executed())

    def _executed(self) -> list[tuple[float, float]]:
        """From `executing` to the last status, once the goal has ended."""
        when = {change.status: change.stamp for change in self.seen.changes}
        over = self.seen.result is not None or any(end in when for end in ("succeeded", "canceled", "aborted"))
        return [(when["executing"], max(when.values()))] if "executing" in when and over else []

    @waits_for("messages while a goal of `{name}` is executed")
    def expect_messages_during(
        self, topic: Topic, *, at_least: int = 1, within: float = WITHIN, hint: str = ""
    ) -> None:
        """Messages go on while it is executed.

        Args:
            topic: whose messages are counted, by the publisher's stamps.
            at_least: so many of them.
            within: seconds until the goal must have ended.
            hint: a pointer for the student.

        Example:
            `goal.expect_messages_during(ros.topic("/ticks", Int64), at_least=2)`

        Codes:
            `paused` or the cause of it, and `extra-publisher`.
        """
        goal = self.seen

        def why() -> Reason | None:
            scene = self._scene()
            aborted = diagnosis.why_not_finished(scene, goal.name) if goal.status == "aborted" else None
            return aborted or diagnosis.why_waits_for_a_goal(scene, goal.name)

        self._expect_messages(
            topic,
            f"a goal of `{goal.name}` is executed",
            self._executed,
            at_least=at_least,
            runs=1,
            within=within,
            hint=hint,
            why=why,
        )


def _unfinished(goal: Goal, within: float) -> tuple[str, str]:
    """Say how far a goal without a result has got, and what to do."""
    state = _state_of(goal)
    because = f"The goal is `{state}`, and it has not ended within {within:g} s."
    if state in ("succeeded", "canceled", "aborted"):
        because = f"The status of the goal is `{state}`, but its execute callback has not returned a result."
        return because, "When its goal has ended, the execute callback has to `return`."
    if state == "accepted":
        hint = "`execute()` of its goal handle has not been called yet: otherwise, the status would be `executing`."
        return because, hint
    hint = "The server accepted the request to cancel. Now the execute callback has to check `is_cancel_requested`."
    return because, hint if goal.agreed else ""


def _state_of(goal: Goal) -> str:
    """Return the last known status of the goal."""
    changes = goal.changes
    return goal.status if goal.result is not None or not changes else changes[-1].status
