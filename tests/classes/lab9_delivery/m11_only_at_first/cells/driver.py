%%node driver
"""Drives towards the last target, around what the lidar sees. Without a new target it stands."""

import math
import time

import numpy as np
import rclpy
from geometry_msgs.msg import Point, Twist
from nav_msgs.msg import Odometry
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from rclpy.qos import qos_profile_sensor_data
from sensor_msgs.msg import LaserScan

ARRIVED = 0.08
PATIENCE = 0.5
HALF_WIDTH = 0.27
AHEAD = 0.9


class Driver(Node):
    def __init__(self):
        super().__init__("driver")
        self.declare_parameter("max_speed", 0.8)
        self.pose = self.target = None
        self.targets = 0
        self.told = self.way = 0.0
        self.wheels = self.create_publisher(Twist, "cmd_vel", 10)
        self.create_subscription(Odometry, "odom", self.on_odom, 10)
        self.create_subscription(Point, "target", self.on_target, 10)
        self.create_subscription(LaserScan, "scan", self.on_scan, qos_profile_sensor_data)

    def on_odom(self, odom):
        place, turned = odom.pose.pose.position, odom.pose.pose.orientation
        self.pose = place.x, place.y, 2 * math.atan2(turned.z, turned.w)

    def on_target(self, target):
        self.targets += target != self.target
        self.target, self.told = target, time.monotonic()

    def on_scan(self, scan):
        command = Twist()
        if self.pose is not None and time.monotonic() - self.told < PATIENCE:
            x, y, heading = self.pose
            away = math.hypot(self.target.x - x, self.target.y - y)
            wanted = math.atan2(self.target.y - y, self.target.x - x) - heading
            if away > ARRIVED:
                before = math.remainder(self.way - heading, math.tau)
                turn = self.free_direction(scan, math.remainder(wanted, math.tau), before, away)
                self.way = heading + turn
                command.angular.z = max(-2.0, min(2.0, 2.5 * turn))
                if abs(turn) < 0.7:
                    limit = self.get_parameter("max_speed").value if self.targets < 2 else 0.8
                    command.linear.x = min(limit, 1.2 * away) * (1 - abs(turn) / 0.7)
        self.wheels.publish(command)

    def free_direction(self, scan, wanted, before, away):
        """Return the free direction that is nearest to the wanted one, as seen from the car. It does not change without need."""
        ranges = np.array(scan.ranges)
        angles = scan.angle_min + scan.angle_increment * np.arange(len(ranges))
        near = ranges < AHEAD + 0.3
        ranges, angles = ranges[near], angles[near]
        best, least = wanted, math.inf
        for direction in np.append(np.linspace(-math.pi, math.pi, 73), wanted):
            ahead, aside = ranges * np.cos(angles - direction), ranges * np.sin(angles - direction)
            blocked = (ahead > 0) & (ahead < min(AHEAD, away + 0.1)) & (np.abs(aside) < HALF_WIDTH)
            cost = abs(math.remainder(direction - wanted, math.tau)) + 0.4 * abs(math.remainder(direction - before, math.tau))
            if not blocked.any() and cost < least:
                best, least = float(direction), cost
        return best if least < math.inf else 1.0


def main():
    rclpy.init()
    try:
        rclpy.spin(Driver())
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    rclpy.try_shutdown()


main()
