%%node taxi
import threading
import time

import rclpy
from rclpy.action import ActionServer, CancelResponse, GoalResponse
from rclpy.executors import ExternalShutdownException, MultiThreadedExecutor
from rclpy.node import Node
from test_msgs.action import Fibonacci


class Taxi(Node):
    def __init__(self):
        super().__init__("taxi")
        self.declare_parameter("block", 0.5)  # seconds
        self.block = self.get_parameter("block").value
        self.current = None  # the handle of the goal that is being driven
        self.lock = threading.Lock()
        self.server = ActionServer(
            self,
            Fibonacci,
            "drive",
            self.execute,
            goal_callback=self.decide,
            handle_accepted_callback=self.accepted,
        )

    def decide(self, goal):
        return GoalResponse.ACCEPT if goal.order > 0 else GoalResponse.REJECT

    def accepted(self, goal_handle):
        """Handle an accepted goal; `goal_handle.execute()` starts to execute it."""
        with self.lock:
            if self.current is not None and self.current.is_active:
                self.current.abort()
            self.current = goal_handle
            self.order = goal_handle.request.order
            goal_handle.execute()

    def execute(self, goal_handle):
        driven = []
        for block in range(1, goal_handle.request.order + 1):
            time.sleep(self.block)
            with self.lock:
                if self.order != goal_handle.request.order:  # there is another goal
                    break
                driven.append(block)
                goal_handle.publish_feedback(Fibonacci.Feedback(sequence=driven))
        with self.lock:
            if goal_handle.is_active:
                goal_handle.succeed()
        return Fibonacci.Result(sequence=driven)


def main():
    rclpy.init()
    executor = MultiThreadedExecutor(num_threads=4)
    executor.add_node(Taxi())
    try:
        executor.spin()
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    rclpy.try_shutdown()


main()
