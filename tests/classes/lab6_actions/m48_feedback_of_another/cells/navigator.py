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
        self.drives = False
        self.server = ActionServer(
            self,
            NestedMessage,
            "navigate",
            self.execute,
            goal_callback=self.decide,
            cancel_callback=lambda goal_handle: CancelResponse.ACCEPT,
        )

    def decide(self, goal):
        target, speed = goal.nested_field.float64_value, goal.nested_field.float32_value
        if self.drives or speed <= 0.0 or not 0.0 <= target <= self.road:
            return GoalResponse.REJECT
        self.drives = True
        return GoalResponse.ACCEPT

    def execute(self, goal_handle):
        try:
            return self.drive(goal_handle)
        finally:
            self.drives = False

    def drive(self, goal_handle):
        goal = goal_handle.request.nested_field
        target, reach = goal.float64_value, 0.1 * goal.float32_value
        way = abs(target - self.position)
        stands = 0.0
        if way < 0.05:
            self.position = target  # as good as there
        while self.position != target:
            time.sleep(0.1)
            if goal_handle.is_cancel_requested:
                goal_handle.canceled()
                return result_of(stands)
            left = target - self.position
            self.position = target if abs(left) <= reach else self.position + (reach if left > 0.0 else -reach)
            stands = self.position
            remaining = abs(target - self.position)
            goal_handle.publish_feedback(feedback_of(remaining, 100.0 * (way - remaining) / way))
        goal_handle.succeed()
        return result_of(self.position)


def spin(node):
    """Run the node's callbacks until the program is told to end."""
    executor = MultiThreadedExecutor(num_threads=3)
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
