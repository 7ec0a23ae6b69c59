%%node fibonacci
import threading
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
        self.results = {}  # order: sequence
        self.server = ActionServer(
            self,
            Fibonacci,
            "fibonacci",
            self.execute,
            goal_callback=self.decide,
            cancel_callback=self.may_cancel,
        )

    def tick(self):
        self.count += 1
        self.ticks.publish(Int64(data=self.count))

    def decide(self, goal):
        return GoalResponse.ACCEPT if 1 <= goal.order <= 46 else GoalResponse.REJECT

    def may_cancel(self, goal_handle):
        return CancelResponse.ACCEPT

    def execute(self, goal_handle):
        order = goal_handle.request.order
        if order in self.results:  # the same question again
            goal_handle.succeed()
            return Fibonacci.Result(sequence=self.results[order])
        sequence = [0, 1]
        while len(sequence) <= order:
            if goal_handle.is_cancel_requested:
                goal_handle.canceled()
                return Fibonacci.Result(sequence=sequence)
            time.sleep(self.step)
            sequence.append(sequence[-1] + sequence[-2])
            goal_handle.publish_feedback(Fibonacci.Feedback(sequence=sequence))
        if goal_handle.is_cancel_requested:
            goal_handle.canceled()
        else:
            self.results[order] = sequence
            goal_handle.succeed()
        return Fibonacci.Result(sequence=sequence)


def spin(node):
    """Run the node's callbacks until the program is told to end."""
    executor = MultiThreadedExecutor(num_threads=4)
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
