%%node fibonacci
import time

import rclpy
from rclpy.action import ActionServer, CancelResponse, GoalResponse
from rclpy.executors import ExternalShutdownException, MultiThreadedExecutor
from rclpy.node import Node
from std_msgs.msg import Int64
from test_msgs.action import Fibonacci


class FibonacciServer(Node):
    def __init__(self):
        super().__init__("fibonacci")
        self.declare_parameter("step", 0.5)  # seconds from one number to the next
        self.step = self.get_parameter("step").value
        self.count = 0
        self.ticks = self.create_publisher(Int64, "ticks", 10)
        self.create_timer(0.1, self.tick)
        self.server = ActionServer(
            self,
            Fibonacci,
            "fibonacci",
            self.execute,
            goal_callback=self.decide,
            cancel_callback=lambda goal_handle: CancelResponse.ACCEPT,
        )

    def decide(self, goal):
        if not 1 <= goal.order <= 46:
            return GoalResponse.REJECT
        self.order = goal.order
        return GoalResponse.ACCEPT

    def execute(self, goal_handle):
        sequence = [0, 1]
        while len(sequence) <= self.order:
            time.sleep(self.step)
            if goal_handle.is_cancel_requested:
                goal_handle.canceled()
                return Fibonacci.Result(sequence=sequence)
            sequence.append(sequence[-1] + sequence[-2])
            goal_handle.publish_feedback(Fibonacci.Feedback(sequence=sequence))
        goal_handle.succeed()
        return Fibonacci.Result(sequence=sequence)

    def tick(self):
        self.count += 1
        self.ticks.publish(Int64(data=self.count))


def spin(node):
    """Run the node's callbacks until the program is told to end."""
    executor = MultiThreadedExecutor(num_threads=2)
    executor.add_node(node)
    executor.spin()


def main():
    rclpy.init()
    node = FibonacciServer()
    try:
        spin(node)
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    rclpy.try_shutdown()


main()
