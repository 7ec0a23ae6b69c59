import threading

import rclpy
from rclpy.action import ActionServer, GoalResponse
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
        self.tick = threading.Event()  # nobody sets it
        self.server = ActionServer(
            self,
            Fibonacci,
            "drive",
            self.execute,
            goal_callback=self.decide,
            handle_accepted_callback=self.accepted,
        )

    def decide(self, goal):
        current = self.current
        if current is not None and current.is_active and current.request.order == goal.order:
            return GoalResponse.REJECT  # a double click: this goal is being driven
        return GoalResponse.ACCEPT if goal.order > 0 else GoalResponse.REJECT

    def accepted(self, goal_handle):
        """Handle an accepted goal; `goal_handle.execute()` starts to execute it."""
        with self.lock:
            if self.current is not None and self.current.is_active:
                self.current.abort()
            self.current = goal_handle
            goal_handle.execute()

    def execute(self, goal_handle):
        driven = []
        while goal_handle.is_active and len(driven) < goal_handle.request.order:
            self.tick.wait(self.block)
            driven.append(len(driven) + 1)
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
