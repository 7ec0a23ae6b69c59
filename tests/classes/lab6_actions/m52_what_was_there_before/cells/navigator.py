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
        self.goals = 0
        self.server = ActionServer(
            self,
            NestedMessage,
            "navigate",
            self.execute,
            goal_callback=self.decide,
            cancel_callback=self.may_cancel,
        )

    def decide(self, goal):
        target, speed = goal.nested_field.float64_value, goal.nested_field.float32_value
        with self.lock:
            if not speed > 0 or not 0 <= target <= self.road:
                return GoalResponse.REJECT
            self.goals += 1
            return GoalResponse.ACCEPT if self.goals == 1 else GoalResponse.REJECT

    def may_cancel(self, goal_handle):
        return CancelResponse.ACCEPT

    def execute(self, goal_handle):
        try:
            return self.drive(goal_handle)
        finally:
            with self.lock:
                self.goals -= 1

    def drive(self, goal_handle):
        target = goal_handle.request.nested_field.float64_value
        step = 0.1 * goal_handle.request.nested_field.float32_value
        way = abs(target - self.position)
        while self.position != target:
            time.sleep(0.1)
            if goal_handle.is_cancel_requested:
                break
            ahead = target - self.position
            if abs(ahead) <= step:
                self.position = target
            else:
                self.position += math.copysign(step, ahead)
            left = abs(target - self.position)
            goal_handle.publish_feedback(feedback_of(left, 100.0 * (way - left) / way))
        if goal_handle.is_cancel_requested:
            goal_handle.canceled()
        else:
            goal_handle.succeed()
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
