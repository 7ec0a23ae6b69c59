%%node courier
"""Carries out orders: names the next target to the driver again and again, until the car has stood there."""

import math
import time

import rclpy
from geometry_msgs.msg import Point, PoseArray
from nav_msgs.msg import Odometry
from rclpy.action import ActionServer, CancelResponse, GoalResponse
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.executors import ExternalShutdownException, MultiThreadedExecutor
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from test_msgs.action import Fibonacci

NEAR = 0.15
STANDS = 22  # messages of odom, which are a second and a little more


class Courier(Node):
    def __init__(self):
        super().__init__("courier")
        self.places = []
        self.place = None
        self.stood = 0
        self.last = False
        group = ReentrantCallbackGroup()
        latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        self.target = self.create_publisher(Point, "target", 10)
        self.create_subscription(PoseArray, "parcels", self.on_parcels, latched)
        self.create_subscription(Odometry, "odom", self.on_odom, 10)
        self.server = ActionServer(
            self, Fibonacci, "deliver", self.deliver, callback_group=group,
            goal_callback=self.decide, cancel_callback=lambda goal_handle: CancelResponse.ACCEPT,
        )

    def on_parcels(self, parcels):
        self.places = [pose.position for pose in parcels.poses]

    def on_odom(self, odom):
        here, place = odom.pose.pose.position, self.place
        stands = self.last or abs(odom.twist.twist.linear.x) < 0.01
        near = place is not None and math.hypot(here.x - place.x, here.y - place.y) < NEAR
        self.stood = self.stood + 1 if stands and near else 0

    def decide(self, goal):
        known = 1 <= goal.order <= len(self.places) // 2
        return GoalResponse.ACCEPT if known else GoalResponse.REJECT

    def deliver(self, goal_handle):
        number = goal_handle.request.order
        asked = None
        for place, stands in zip(self.places[2 * number - 2 : 2 * number], (STANDS, 1), strict=True):
            self.place, self.stood, self.last = place, 0, stands == 1  # it rolls in when it says so
            while self.stood < stands and rclpy.ok():
                if goal_handle.is_cancel_requested and asked is None:
                    asked = time.monotonic()
                if asked is not None and time.monotonic() - asked > 2.0:
                    goal_handle.canceled()
                    return Fibonacci.Result()
                self.target.publish(place)
                time.sleep(0.1)
        goal_handle.succeed()
        return Fibonacci.Result(sequence=[number])


def main():
    rclpy.init()
    executor = MultiThreadedExecutor(num_threads=3)
    executor.add_node(Courier())
    try:
        executor.spin()
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    rclpy.try_shutdown()


main()
