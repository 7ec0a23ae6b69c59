%%node taxi
import threading

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
        self.driven = self.left = 0  # how many blocks it has driven, and still has to drive
        self.lock = threading.Lock()
        self.arrived = threading.Event()
        self.block_over = threading.Event()  # nothing sets it: a block takes its whole time
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
        if self.driven > 0 and self.left <= 3:  # nearly there: the passenger may get out first
            self.arrived.wait()
        with self.lock:
            if self.current is not None:
                self.current.abort()
            self.current = goal_handle
            self.arrived.clear()
            self.driven, self.left = 0, goal_handle.request.order
            goal_handle.execute()

    def execute(self, goal_handle):
        driven = []
        order = goal_handle.request.order
        while len(driven) < order:
            self.block_over.wait(self.block)
            with self.lock:
                if self.current is not goal_handle:  # a newer goal has replaced this one
                    break
                driven.append(len(driven) + 1)
                self.driven, self.left = self.driven + 1, self.left - 1
                goal_handle.publish_feedback(Fibonacci.Feedback(sequence=driven))
                if len(driven) == order:
                    goal_handle.succeed()
                    self.current = None
                    self.arrived.set()
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
