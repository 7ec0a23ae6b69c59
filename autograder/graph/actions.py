"""Goals sent to a student's action server: accepted or not, feedback, status, result, cancelling."""

from __future__ import annotations

import uuid
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from action_msgs.msg import GoalStatus, GoalStatusArray
from rclpy.action import ActionClient
from rclpy.task import Future
from unique_identifier_msgs.msg import UUID

from autograder.graph.observer import Observer
from autograder.graph.recording import Received
from autograder.graph.services import ServiceMissing

STATUS_WORDS = {
    GoalStatus.STATUS_UNKNOWN: "unknown",
    GoalStatus.STATUS_ACCEPTED: "accepted",
    GoalStatus.STATUS_EXECUTING: "executing",
    GoalStatus.STATUS_CANCELING: "canceling",
    GoalStatus.STATUS_SUCCEEDED: "succeeded",
    GoalStatus.STATUS_CANCELED: "canceled",
    GoalStatus.STATUS_ABORTED: "aborted",
}
"""The words of action_msgs/GoalStatus."""

UNDER_WAY = (GoalStatus.STATUS_EXECUTING, GoalStatus.STATUS_CANCELING)
"""Statuses of a goal that is being executed."""


def _never() -> bool:
    return False


class ActionSeen:
    """One action of the student's: a client of it, and what its server publishes, in the server's own order.

    Feedback and statuses are recorded as any topic is. So each has the server's own stamp, and what the observer was
    too busy to take at once is in order all the same.
    """

    def __init__(self, observer: Observer, name: str, action_type: type) -> None:
        """Begin to listen."""
        self.name, self.action_type = name, action_type
        self.client = ActionClient(observer.node, action_type, name)
        self.feedback = observer.record(f"{name}/_action/feedback", action_type.Impl.FeedbackMessage)  # type: ignore[attr-defined]
        self.statuses = observer.record(f"{name}/_action/status", GoalStatusArray)

    def ready(self) -> bool:
        """Whether the server is there, and everything it publishes will be heard."""
        return bool(self.client.server_is_ready() and self.feedback.matched and self.statuses.matched)

    def most_at_once(self) -> int:
        """How many goals the server has executed at the same time, at the most, by its own status messages."""
        return max(
            (sum(each.status in UNDER_WAY for each in heard.msg.status_list) for heard in self.statuses.messages),
            default=0,
        )


@dataclass(frozen=True)
class Change:
    """A goal's status, as its server published it."""

    status: str
    """A word of `STATUS_WORDS`."""
    stamp: float
    """When, on the system clock, as the stamps of feedback are."""


@dataclass(eq=False)
class Goal:
    """One goal and what the server has said about it so far; `send_goal` makes it."""

    action: ActionSeen
    accepted: bool | None = None
    """None until the server has answered."""
    status: str = "unknown"
    """A word of `STATUS_WORDS`: how the goal ended, or what came of the request."""
    result: Any | None = None
    """The result message; None until the goal has ended (an aborted goal has one too)."""
    agreed: bool | None = None
    """Whether the server agreed to cancel it; None until it has answered such a request."""
    id: list[int] = field(default_factory=lambda: list(uuid.uuid4().bytes))

    _observer: Observer = field(kw_only=True)
    _give_up: Callable[[], bool] = field(kw_only=True)
    _handle: Any | None = None

    @property
    def name(self) -> str:
        """The full name of its action."""
        return self.action.name

    @property
    def heard(self) -> list[Received]:
        """Its feedback in the order of publishing, with stamps; `msg.feedback` is the message."""
        return [heard for heard in self.action.feedback.messages if list(heard.msg.goal_id.uuid) == self.id]

    @property
    def feedback(self) -> list[Any]:
        """Its feedback messages in the order of publishing."""
        return [heard.msg.feedback for heard in self.heard]

    @property
    def changes(self) -> list[Change]:
        """The statuses that it went through, as its server published them."""
        found: list[Change] = []
        for heard in self.action.statuses.messages:
            for each in heard.msg.status_list:
                word = STATUS_WORDS.get(each.status, "unknown")
                if list(each.goal_info.goal_id.uuid) == self.id and (not found or found[-1].status != word):
                    found.append(Change(word, heard.stamp))
        return found

    def _on_executor(self, act: Callable[[], Future], done: Callable[[Any], None]) -> None:
        # rclpy notes a request only after it has sent it: from another thread than the executor's, a fast answer can
        # come in between and is then dropped as unexpected.
        def run() -> None:
            act().add_done_callback(finished)

        def finished(future: Future) -> None:
            done(future.result())
            self._observer.notify()

        self._observer.node.executor.create_task(run)

    def _send(self, goal: Any) -> None:
        uuid_message = UUID(uuid=self.id)
        self._on_executor(lambda: self.action.client.send_goal_async(goal, goal_uuid=uuid_message), self._answered)

    def _answered(self, handle: Any) -> None:
        self._handle = handle
        self.accepted = bool(handle.accepted)
        if self.accepted:
            self.status = "accepted"
            handle.get_result_async().add_done_callback(self._ended)

    def _ended(self, future: Future) -> None:
        self.status = STATUS_WORDS.get(future.result().status, "unknown")
        self.result = future.result().result
        self._observer.answers.append((self.name, self.result))
        self._observer.notify()

    @property
    def empty_handed(self) -> bool:
        """Whether its result has come, and nothing in it has been set."""
        return self.result is not None and bool(self.result == type(self.result)())

    def wait_for_feedback(self, count: int, within: float = 10.0) -> bool:
        """Wait until at least `count` feedback messages are there; at most `within` seconds."""
        return self._observer.wait(lambda: len(self.heard) >= count, within, self._give_up)

    def wait_for_result(self, within: float = 10.0) -> bool:
        """Wait until the goal has ended; at most `within` seconds."""
        return self._observer.wait(lambda: self.result is not None, within, self._give_up)

    def cancel(self, within: float = 5.0) -> bool:
        """Ask the server to cancel this goal; whether it agreed within `within` seconds.

        The goal has then not yet ended: `wait_for_result` waits for that.
        """
        if not self.accepted or self._handle is None:
            return False

        def answered(reply: Any) -> None:
            self.agreed = bool(reply.goals_canceling)

        self._on_executor(self._handle.cancel_goal_async, answered)
        self._observer.wait(lambda: self.agreed is not None, within, self._give_up)
        return bool(self.agreed)


def send_goal(
    observer: Observer,
    action: ActionSeen,
    goal: Any,
    within: float,
    give_up: Callable[[], bool] = _never,
) -> Goal:
    """Send a goal and wait for the server to accept or reject it (`Goal.accepted` stays None if it did not answer).

    Args:
        observer: who asks.
        action: the action.
        goal: the goal message.
        within: seconds, once for the server to appear and once for its answer.
        give_up: says that no answer can come any more, for example because the program ended.

    Raises:
        ServiceMissing: no server appeared.
    """
    if not observer.wait(action.ready, within, give_up):
        raise ServiceMissing(action.name)
    sent = Goal(action, _observer=observer, _give_up=give_up)
    sent._send(goal)
    observer.wait(lambda: sent.accepted is not None, within, give_up)
    return sent
