"""Sends goals to a student's action server, and records acceptance, feedback, status, result and cancelling."""

from __future__ import annotations

import time
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
"""The name of each status in action_msgs/GoalStatus."""

UNDER_WAY = (GoalStatus.STATUS_EXECUTING, GoalStatus.STATUS_CANCELING)
"""The statuses of a goal that is being executed."""


def _never() -> bool:
    return False


class ActionSeen:
    """One of the student's actions: a client for it, and what its server publishes, in the server's own order.

    Feedback and statuses are recorded like any topic. So each message has the server's own stamp, and messages that the
    observer was too busy to take immediately are still in order.
    """

    def __init__(self, observer: Observer, name: str, action_type: type) -> None:
        """Create the client and begin to record."""
        self.name, self.action_type = name, action_type
        self.sent = 0  # goals so far
        self.client = ActionClient(observer.node, action_type, name)
        self.feedback = observer.record(f"{name}/_action/feedback", action_type.Impl.FeedbackMessage)  # type: ignore[attr-defined]
        self.statuses = observer.record(f"{name}/_action/status", GoalStatusArray)

    def ready(self) -> bool:
        """Whether the server is available, and everything that it publishes will be received."""
        return bool(self.client.server_is_ready() and self.feedback.matched and self.statuses.matched)

    def most_at_once(self) -> int:
        """Return the largest number of goals that the server executed at once, according to its status messages."""
        return max(
            (sum(each.status in UNDER_WAY for each in heard.msg.status_list) for heard in self.statuses.messages),
            default=0,
        )


@dataclass(frozen=True)
class Change:
    """A change of a goal's status, as its server published it."""

    status: str
    """A word of `STATUS_WORDS`."""
    stamp: float
    """When it was published, in seconds on the system clock, like the stamps of feedback."""


@dataclass(eq=False)
class Goal:
    """One goal and what the server has said about it so far; `send_goal` creates it."""

    action: ActionSeen
    number: int
    """Its place among the goals that were sent to this action, from 1."""
    accepted: bool | None = None
    """None until the server has answered."""
    status: str = "unknown"
    """A word of `STATUS_WORDS`: `unknown` until the goal is accepted, then `accepted`, and at the end how it ended."""
    result: Any | None = None
    """The result message; None until the goal has ended (an aborted goal has one too)."""
    agreed: bool | None = None
    """Whether the server agreed to cancel the goal; None until it has answered such a request."""
    cancel_sent: float = 0.0
    """When the last request to cancel it was sent, in seconds on the system clock; 0 before."""
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
        """Its feedback in the order of publishing, with stamps; the feedback message itself is `msg.feedback`."""
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
        # rclpy registers a request only after it has sent it. If the request is sent from another thread than the
        # executor's, a fast response can arrive in between, and rclpy drops it as unexpected.
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
        """Whether its result has come, and no field in it has been set."""
        return self.result is not None and bool(self.result == type(self.result)())

    def wait_for_feedback(self, count: int, within: float = 10.0) -> bool:
        """Wait until at least `count` feedback messages have come; at most `within` seconds."""
        return self._observer.wait(lambda: len(self.heard) >= count, within, self._give_up)

    def wait_for_result(self, within: float = 10.0) -> bool:
        """Wait until the goal has ended; at most `within` seconds."""
        return self._observer.wait(lambda: self.result is not None, within, self._give_up)

    def cancel(self, within: float = 5.0) -> bool:
        """Ask the server to cancel this goal, and return whether it agreed within `within` seconds.

        The goal has not necessarily ended then: use `wait_for_result` to wait for its end.
        """
        if not self.accepted or self._handle is None:
            return False

        def answered(reply: Any) -> None:
            self.agreed = bool(reply.goals_canceling)

        self.cancel_sent = time.time()
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
    """Send a goal and wait for the server to accept or reject it (`Goal.accepted` stays None if it does not answer).

    Args:
        observer: the observer that sends the goal.
        action: the action.
        goal: the goal message.
        within: the seconds to wait, once for the server to appear and once for its response.
        give_up: returns true if no response can come any more, for example because the program has ended.

    Raises:
        ServiceMissing: no server appeared.
    """
    if not observer.wait(action.ready, within, give_up):
        raise ServiceMissing(action.name)
    action.sent += 1
    sent = Goal(action, action.sent, _observer=observer, _give_up=give_up)
    sent._send(goal)
    observer.wait(lambda: sent.accepted is not None, within, give_up)
    return sent
