"""Expectations of what goes on while a callback runs or a service is being called."""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections.abc import Sequence
from typing import TYPE_CHECKING

from autograder import diagnosis
from autograder.checks import outcomes
from autograder.checks.expect import rates
from autograder.checks.expect.concurrency import ConcurrencyExpectations
from autograder.checks.expect.expectations import WITHIN
from autograder.checks.expect.offering import Offering
from autograder.checks.expect.sources import SourceExpectations
from autograder.reasons import Group, Kind

if TYPE_CHECKING:
    from autograder.graph.actions import Goal

PAUSED = Kind(
    "paused", "messages stopped while a callback ran; no other reason was established", Group.MESSAGES, "timeline"
)


class MeanwhileExpectations(ConcurrencyExpectations, SourceExpectations, Offering):
    """What must go on meanwhile."""

    def messages_during(
        self,
        topic: str,
        msg_type: type,
        *,
        callback: str = "",
        activity: str = "",
        service: str = "",
        goal: Goal | None = None,
    ) -> list[int]:
        """How many messages on `topic` were published during each run of a callback or each call of a service so far.

        Or while a goal of an action was executed.

        Args:
            topic: full name of the topic whose messages are counted, by the publisher's stamps.
            msg_type: their class.
            callback: a callback that publishes `NAME begin` and `NAME end` (`std_msgs/String`) ...
            activity: ... on this topic.
            service: or a service that the check offers (`serve`): from a request's arrival to its answer.
            goal: or a goal that has ended: from the status `executing` to its last one.

        Example:
            `counts = ros.messages_during("/heartbeat", Int64, callback="slow", activity="/activity")`
        """
        if goal is not None:
            when = {change.status: change.stamp for change in goal.changes}
            over = goal.result is not None or any(end in when for end in ("succeeded", "canceled", "aborted"))
            spans = [(when["executing"], max(when.values()))] if "executing" in when and over else []
        elif service:
            spans = self.served(service)
        else:
            spans = [(span.begin, span.end) for span in self.concurrency(activity).spans() if span.name == callback]
        # Looked up, not counted one by one: a program decides how many runs and how many messages there are.
        stamps = sorted(received.stamp for received in self._observer.record(topic, msg_type).messages)
        return [max(0, bisect_left(stamps, end) - bisect_right(stamps, begin)) for begin, end in spans]

    def expect_messages_during(
        self,
        topic: str,
        msg_type: type,
        *,
        callback: str = "",
        activity: str = "",
        service: str = "",
        goal: Goal | None = None,
        at_least: int = 1,
        runs: int = 3,
        within: float = WITHIN,
        hint: str = "",
    ) -> None:
        """Messages go on while a slow callback runs, while the node waits for a service or while it executes a goal.

        One run with enough messages is enough: a busy machine may have stopped the whole node during another.

        Args:
            topic: as for `messages_during`, like `msg_type`, `callback`, `activity` and `service`.
            msg_type: message class.
            callback: name in `activity`.
            activity: topic of begins and ends.
            service: full name of an offered service, instead of a callback.
            goal: a goal that `send_goal` returned, instead of a callback.
            at_least: messages in one run.
            runs: complete runs (or answered calls) to look at before giving up.
            within: seconds until these must have come.
            hint: a pointer for the student.

        Example:
            `ros.expect_messages_during("/heartbeat", Int64, callback="slow", activity="/activity", at_least=2)`

        Codes:
            `paused` or the cause of it, `extra-publisher`, and those of `expect_runs`.
        """
        title = f"`{topic}` goes on while " + (f"`{service}` is being called" if service else f"`{callback}` runs")
        if goal is not None:
            title, runs = f"`{topic}` goes on while a goal of `{goal.name}` is executed", 1

        def counts() -> list[int]:
            return self.messages_during(
                topic, msg_type, callback=callback, activity=activity, service=service, goal=goal
            )

        def enough() -> bool:
            return max(counts(), default=0) >= at_least

        self.wait(lambda: enough() or len(counts()) >= runs, within)
        self._observer.wait(enough, 0.2)  # the last messages may come after the end that lies behind them
        seen = counts()
        if not enough():
            if callback and not seen:
                self._wait_for_runs(activity, [callback], 1, title, 0.0, hint)
            if callback:
                self._too_short(title, topic, msg_type, activity, callback, at_least, hint)
            self._paused(title, topic, activity or topic, seen, at_least, goal, hint)
        self._one_source(title, topic, msg_type, "", 1, self._observer.record(topic, msg_type).messages)
        outcomes.passed(title, observed=", ".join(str(count) for count in seen))

    def _too_short(
        self, title: str, topic: str, msg_type: type, activity: str, callback: str, at_least: int, hint: str
    ) -> None:
        """Fail if no run of the callback was long enough for so many messages, at the pace at which these come."""
        gap = rates.median_gap(self._observer.record(topic, msg_type).messages)
        spans = [span.end - span.begin for span in self.concurrency(activity).spans() if span.name == callback]
        if spans and 0.0 < max(spans) < (at_least - 1) * gap:
            self._fail(
                title,
                PAUSED(
                    f"The longest run of `{callback}` took {max(spans):.2f} s, and a message arrives on `{topic}` "
                    f"every {gap:.2f} s. Such a run is too short for {at_least} messages.",
                ),
                expected=f"at least {at_least} messages in one run",
                observed=f"runs of at most {max(spans):.2f} s",
                hint=hint,
            )

    def _paused(
        self, title: str, topic: str, activity: str, seen: Sequence[int], at_least: int, goal: Goal | None, hint: str
    ) -> None:
        scene = self._scene()
        most = max(seen, default=0)
        number = f"At most {most} message{'s' * (most != 1)}" if most else "No message"
        self._fail(
            title,
            diagnosis.program_trouble(scene)
            or diagnosis.inside_reason(scene)
            or (diagnosis.why_not_finished(scene, goal.name) if goal and goal.status == "aborted" else None)
            or (diagnosis.why_waits_for_a_goal(scene, goal.name) if goal else None)
            or diagnosis.waits_for_its_group(scene)
            or diagnosis.why_not_together(scene, activity)
            or PAUSED(f"{number} arrived on `{topic}` during one run. {diagnosis.layout(scene, activity)}"),
            expected=f"at least {at_least} messages in one run",
            observed=", ".join(str(count) for count in seen) or "no complete run",
            hint=hint,
        )
