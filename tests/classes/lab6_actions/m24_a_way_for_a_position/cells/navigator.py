%%node navigator
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
        self.driving = False
        self.server = ActionServer(
            self,
            NestedMessage,
            "navigate",
            self.execute,
            goal_callback=self.decide,
            cancel_callback=self.cancel,
        )

    def decide(self, goal):
        target = goal.nested_field.float64_value
        speed = goal.nested_field.float32_value
        if self.driving or speed <= 0.0 or target < 0.0 or target > self.road:
            return GoalResponse.REJECT
        self.driving = True
        return GoalResponse.ACCEPT

    def cancel(self, goal_handle):
        return CancelResponse.ACCEPT

    def execute(self, goal_handle):
        field = goal_handle.request.nested_field
        target, speed = field.float64_value, field.float32_value
        direction = 1.0 if target >= self.position else -1.0
        whole = abs(target - self.position)
        driven = 0.0  # metres of this goal's way
        begin = self.position
        while driven < whole:
            time.sleep(0.1)
            if goal_handle.is_cancel_requested:
                self.driving = False
                goal_handle.canceled()
                return result_of(driven)
            driven = min(whole, driven + 0.1 * speed)
            self.position = begin + direction * driven
            goal_handle.publish_feedback(feedback_of(whole - driven, 100.0 * driven / whole))
        self.position = target
        self.driving = False
        goal_handle.succeed()
        return result_of(target)


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
