"""Goals sent to a student's action server: accepted or not, feedback, status, result, cancelling."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

from action_msgs.msg import GoalStatus
from action_msgs.srv import CancelGoal
from rclpy.action import ActionClient
from rclpy.qos import QoSProfile
from rclpy.task import Future

from autograder.graph.observer import Observer
from autograder.graph.services import ServiceMissing

FEEDBACK_DEPTH = 1000
"""Messages. rclpy's own 10 would lose feedback of a fast server while the observer is not scheduled."""

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


def _never() -> bool:
    return False


class Goal:
    """One goal and what the server has said about it so far; `send_goal` makes it."""

    def __init__(self, observer: Observer, client: ActionClient, give_up: Callable[[], bool]) -> None:
        """Wrap a goal that is about to be sent."""
        self.accepted: bool | None = None
        """None until the server has answered."""
        self.feedback: list[Any] = []
        """Feedback messages in the order of arrival."""
        self.feedback_times: list[float] = []
        """When each of them arrived, seconds on the monotonic clock."""
        self.status = "unknown"
        """A word of `STATUS_WORDS`: how the goal ended, or what came of the request."""
        self.result: Any | None = None
        """The result message; None until the goal has ended (an aborted goal has one too)."""
        self._observer = observer
        self._client = client
        self._give_up = give_up
        self._handle: Any | None = None

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
        self._on_executor(lambda: self._client.send_goal_async(goal, feedback_callback=self._hear), self._answered)

    def _hear(self, message: Any) -> None:
        self.feedback_times.append(time.monotonic())
        self.feedback.append(message.feedback)
        self._observer.notify()

    def _answered(self, handle: Any) -> None:
        self._handle = handle
        self.accepted = bool(handle.accepted)
        if self.accepted:
            self.status = "accepted"
            handle.get_result_async().add_done_callback(self._ended)

    def _ended(self, future: Future) -> None:
        self.status = STATUS_WORDS.get(future.result().status, "unknown")
        self.result = future.result().result
        self._observer.notify()

    def wait_for_feedback(self, count: int, within: float = 10.0) -> bool:
        """Wait until at least `count` feedback messages are there; at most `within` seconds."""
        return self._observer.wait(lambda: len(self.feedback) >= count, within, self._give_up)

    def wait_for_result(self, within: float = 10.0) -> bool:
        """Wait until the goal has ended; at most `within` seconds."""
        return self._observer.wait(lambda: self.result is not None, within, self._give_up)

    def cancel(self, within: float = 5.0) -> bool:
        """Ask the server to cancel this goal; whether it agreed within `within` seconds.

        The goal has then not yet ended: `wait_for_result` waits for that.
        """
        if not self.accepted or self._handle is None:
            return False
        replies: list[CancelGoal.Response] = []
        self._on_executor(self._handle.cancel_goal_async, replies.append)
        self._observer.wait(lambda: replies, within, self._give_up)
        return bool(replies and replies[0].return_code == CancelGoal.Response.ERROR_NONE and replies[0].goals_canceling)


def send_goal(
    observer: Observer,
    name: str,
    action_type: type,
    goal: Any,
    within: float,
    give_up: Callable[[], bool] = _never,
) -> Goal:
    """Send a goal and wait for the server to accept or reject it (`Goal.accepted` stays None if it did not answer).

    Args:
        observer: who asks.
        name: full action name.
        action_type: action class.
        goal: the goal message.
        within: seconds, once for the server to appear and once for its answer.
        give_up: says that no answer can come any more, for example because the program ended.

    Raises:
        ServiceMissing: no server appeared.
    """
    client = ActionClient(observer.node, action_type, name, feedback_sub_qos_profile=QoSProfile(depth=FEEDBACK_DEPTH))
    if not observer.wait(client.server_is_ready, within, give_up):
        client.destroy()
        raise ServiceMissing(name)
    sent = Goal(observer, client, give_up)
    sent._send(goal)
    observer.wait(lambda: sent.accepted is not None, within, give_up)
    return sent
