%%node navigator
import math
import threading
import time
from dataclasses import dataclass
from enum import Enum, auto
from typing import Callable, Dict, Optional

import rclpy
from rclpy.action import ActionServer, CancelResponse, GoalResponse
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.executors import ExternalShutdownException, MultiThreadedExecutor
from rclpy.node import Node
from std_msgs.msg import Float64
from test_msgs.action import NestedMessage


def feedback_of(remaining, percent):
    message = NestedMessage.Feedback()
    message.nested_field.float64_value = remaining
    message.nested_field.float32_value = percent
    return message


def result_of(position):
    message = NestedMessage.Result()
    message.nested_field.float64_value = position
    return message


STEP: float = 0.1  # seconds
EPSILON: float = 0.05  # metres; floats are never compared exactly


class Outcome(Enum):
    ARRIVED = auto()
    CANCELED = auto()


@dataclass(frozen=True)
class Trip:
    """A way from where the car stands to the target; every place on it is computed from its beginning."""

    start: float
    target: float
    speed: float

    @property
    def way(self) -> float:
        return abs(self.target - self.start)

    def driven_after(self, steps: int) -> float:
        driven = steps * STEP * self.speed
        return driven if driven < self.way - 1e-9 else self.way

    def place(self, driven: float) -> float:
        if driven >= self.way:
            return self.target
        return self.start + math.copysign(driven, self.target - self.start)


class Navigator(Node):
    def __init__(self):
        super().__init__("navigator")
        self.declare_parameter("road", 100.0)  # metres
        self.road = self.get_parameter("road").value
        self.position = 0.0
        self.publisher = self.create_publisher(Float64, "position", 10)
        self.create_timer(0.1, lambda: self.publisher.publish(Float64(data=self.position)))
        self.driving = threading.Semaphore(1)  # who has it, drives
        self.server = ActionServer(
            self,
            NestedMessage,
            "navigate",
            self.execute,
            goal_callback=self.decide,
            cancel_callback=lambda goal_handle: CancelResponse.ACCEPT,
            callback_group=ReentrantCallbackGroup(),
        )
        self.finishers: Dict[Outcome, Callable] = {
            Outcome.ARRIVED: lambda goal_handle: goal_handle.succeed(),
            Outcome.CANCELED: lambda goal_handle: goal_handle.canceled(),
        }

    def refusal(self, goal: NestedMessage.Goal) -> Optional[str]:
        """Say why a goal cannot be accepted at all; None if it can."""
        target, speed = goal.nested_field.float64_value, goal.nested_field.float32_value
        if not speed > 0.0:
            return f"the speed {speed} is not above 0"
        if not -EPSILON <= target <= self.road + EPSILON:
            return f"the target {target} is not on the road of {self.road} m"
        return None

    def decide(self, goal: NestedMessage.Goal) -> GoalResponse:
        reason = self.refusal(goal)
        if reason is None and not self.driving.acquire(blocking=False):
            reason = "the car is driving"
        if reason is not None:
            self.get_logger().info(f"rejected: {reason}")
            return GoalResponse.REJECT
        return GoalResponse.ACCEPT

    def execute(self, goal_handle) -> NestedMessage.Result:
        try:
            wanted = goal_handle.request.nested_field
            outcome = self.drive(Trip(self.position, wanted.float64_value, wanted.float32_value), goal_handle)
            self.finishers[outcome](goal_handle)
            return result_of(self.position)
        finally:
            self.driving.release()  # before the result is sent

    def drive(self, trip: Trip, goal_handle) -> Outcome:
        steps, driven, due = 0, 0.0, time.monotonic()
        while self.position != trip.target:
            steps += 1
            now = time.monotonic()
            due = due + STEP if due + STEP > now else now + STEP  # no hurry after a delay
            time.sleep(due - now)
            if goal_handle.is_cancel_requested:
                return Outcome.CANCELED
            driven = trip.driven_after(steps)
            self.position = trip.place(driven)
            remaining = abs(trip.target - self.position)
            percent = 100.0 if self.position == trip.target else 100.0 * driven / trip.way
            goal_handle.publish_feedback(feedback_of(remaining, percent))
        return Outcome.ARRIVED


def spin(node):
    """Run the node's callbacks until the program is told to end."""
    executor = MultiThreadedExecutor(num_threads=4)
    executor.add_node(node)
    executor.spin()


def main():
    rclpy.init()
    node = Navigator()
    try:
        spin(node)
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    rclpy.try_shutdown()


main()
