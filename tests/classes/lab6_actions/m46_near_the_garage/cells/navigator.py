%%node navigator
import math
import threading
import time

import rclpy
from rclpy.action import ActionServer, CancelResponse, GoalResponse
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


class Navigator(Node):
    def __init__(self):
        super().__init__("navigator")
        self.declare_parameter("road", 100.0)  # metres
        self.road = self.get_parameter("road").value
        self.position = 0.0
        self.publisher = self.create_publisher(Float64, "position", 10)
        self.create_timer(0.1, lambda: self.publisher.publish(Float64(data=self.position)))
        self.lock = threading.Lock()
        self.step_over = threading.Event()  # nothing sets it: a step takes its whole 0.1 s
        self.busy = False
        self.free_at = 0.0  # near its garage, the car rests after a stop
        self.server = ActionServer(
            self,
            NestedMessage,
            "navigate",
            self.execute,
            goal_callback=self.decide,
            cancel_callback=lambda goal_handle: CancelResponse.ACCEPT,
        )

    def possible(self, goal):
        target, speed = goal.nested_field.float64_value, goal.nested_field.float32_value
        return speed > 0.0 and 0.0 <= target <= self.road

    def decide(self, goal):
        with self.lock:
            if self.busy or time.monotonic() < self.free_at or not self.possible(goal):
                return GoalResponse.REJECT
            self.busy = True
        return GoalResponse.ACCEPT

    def execute(self, goal_handle):
        goal = goal_handle.request.nested_field
        target, step = goal.float64_value, 0.1 * min(goal.float32_value, 5.0)  # no car is faster here
        way = abs(target - self.position)
        while self.position != target:
            self.step_over.wait(0.1)
            if goal_handle.is_cancel_requested:
                break
            left = target - self.position
            self.position = target if abs(left) <= step + 1e-9 else self.position + math.copysign(step, left)
            left = abs(target - self.position)
            goal_handle.publish_feedback(feedback_of(left, 100.0 * (way - left) / way))
        if goal_handle.is_cancel_requested:
            goal_handle.canceled()
            self.free_at = time.monotonic() + (3.0 if self.position < 2.0 else 0.0)
        else:
            goal_handle.succeed()
        with self.lock:
            self.busy = False
        return result_of(self.position)


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
