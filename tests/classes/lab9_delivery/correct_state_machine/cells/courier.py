%%node courier
import math
import threading

import rclpy
from geometry_msgs.msg import Point, PoseArray
from nav_msgs.msg import Odometry
from rclpy.action import ActionServer, CancelResponse, GoalResponse
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup
from rclpy.executors import ExternalShutdownException, MultiThreadedExecutor
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from test_msgs.action import Fibonacci


class Courier(Node):
    """IDLE -> FETCHING -> BRINGING -> IDLE, driven by the odometry."""

    def __init__(self):
        super().__init__("courier")
        self.route, self.parcels, self.count, self.order = [], [], 0, None
        self.over = threading.Event()
        self.target = self.create_publisher(Point, "target", 1)
        self.create_subscription(PoseArray, "parcels", self.on_parcels, QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL))
        self.create_subscription(Odometry, "odom", self.step, 10)
        ActionServer(
            self, Fibonacci, "deliver", self.execute, goal_callback=self.on_goal, cancel_callback=self.on_cancel,
            callback_group=MutuallyExclusiveCallbackGroup(),
        )

    def on_parcels(self, parcels):
        places = [pose.position for pose in parcels.poses]
        self.parcels = list(zip(places[::2], places[1::2]))

    def on_goal(self, goal):
        free = self.order is None
        return GoalResponse.ACCEPT if free and 0 < goal.order <= len(self.parcels) else GoalResponse.REJECT

    def on_cancel(self, handle):
        return CancelResponse.ACCEPT

    def step(self, odom):
        handle = self.order
        if handle is None or not self.route:
            return
        if handle.is_cancel_requested:
            self.route = []
            self.over.set()
            return
        here, place = odom.pose.pose.position, self.route[0]
        there = math.dist((here.x, here.y), (place.x, place.y)) < 0.18 and abs(odom.twist.twist.linear.x) < 0.01
        self.count = self.count + 1 if there else 0
        self.target.publish(place)
        if self.count == 24:
            self.count = 0
            self.route = self.route[1:]
            handle.publish_feedback(Fibonacci.Feedback(sequence=[2 - len(self.route)]))
            if not self.route:
                self.over.set()

    def execute(self, handle):
        self.over.clear()
        self.count, self.order = 0, handle
        self.route = list(self.parcels[handle.request.order - 1])
        while rclpy.ok() and not self.over.wait(0.5):
            pass
        self.order = None
        if handle.is_cancel_requested:
            handle.canceled()
        else:
            handle.succeed()
        return Fibonacci.Result()


def main():
    rclpy.init()
    try:
        executor = MultiThreadedExecutor()
        executor.add_node(Courier())
        executor.spin()
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        rclpy.try_shutdown()


main()
