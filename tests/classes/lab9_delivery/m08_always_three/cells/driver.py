%%node driver
import math
from typing import Optional, Tuple

import numpy as np
import rclpy
from geometry_msgs.msg import PoseArray, Twist
from nav_msgs.msg import Odometry
from rcl_interfaces.msg import ParameterDescriptor
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from rclpy.qos import qos_profile_sensor_data
from sensor_msgs.msg import LaserScan


def heading_of(orientation) -> float:
    return 2.0 * math.atan2(orientation.z, orientation.w)


class Pilot:
    """Decides how to drive: the free direction that is nearest to that of the target. Knows nothing of ROS."""

    ANGLES = np.radians(np.arange(-180.0, 180.0, 5.0))
    ARRIVED, LEFT = 0.08, 0.14  # metres from the target: here the car stops, and there it begins again

    def __init__(self) -> None:
        self.points = np.zeros((0, 2))  # what the lidar sees, in the car's frame
        self.course: Optional[float] = None  # the direction that was chosen last, in the frame of the odometry
        self.there = False
        self.seen = False  # before the first scan the car is blind

    def see(self, scan) -> None:
        self.seen = True
        ranges = np.asarray(scan.ranges, dtype=float)
        angles = scan.angle_min + scan.angle_increment * np.arange(len(ranges))
        good = np.isfinite(ranges) & (ranges > max(scan.range_min, 0.02)) & (ranges < min(scan.range_max, 2.5))
        self.points = np.column_stack((ranges[good] * np.cos(angles[good]), ranges[good] * np.sin(angles[good])))

    def forget(self) -> None:
        self.course, self.there = None, False

    def free(self, reach: float, half_width: float) -> np.ndarray:
        """Return for each angle whether nothing stands in a lane of this length and width."""
        x, y = self.points[:, 0:1], self.points[:, 1:2]
        along = x * np.cos(self.ANGLES) + y * np.sin(self.ANGLES)
        across = y * np.cos(self.ANGLES) - x * np.sin(self.ANGLES)
        return ~np.any((along > 0.0) & (along < reach) & (np.abs(across) < half_width), axis=0)

    def clearance(self) -> float:
        """Return how far it is straight ahead to the next thing."""
        ahead = self.points[(self.points[:, 0] > 0.0) & (np.abs(self.points[:, 1]) < 0.2)]
        return float(ahead[:, 0].min()) if len(ahead) else 10.0

    def steer(self, x: float, y: float, heading: float, target: Tuple[float, float], most: float) -> Tuple[float, float]:
        """Return the speed and the turn with which to drive on to the target."""
        distance = math.dist((x, y), target)
        self.there = distance < (self.LEFT if self.there else self.ARRIVED)
        if self.there:
            return 0.0, 0.0
        bearing = math.remainder(math.atan2(target[1] - y, target[0] - x) - heading, math.tau)
        cost = np.abs(np.remainder(self.ANGLES - bearing + math.pi, math.tau) - math.pi)
        if self.course is not None:
            cost = cost + 0.4 * np.abs(np.remainder(self.ANGLES - (self.course - heading) + math.pi, math.tau) - math.pi)
        error = None
        for reach, half_width in ((0.65, 0.28), (0.45, 0.25), (0.35, 0.2)):
            free = self.free(min(reach, distance + 0.15), half_width)
            if free.any():
                best = int(np.argmin(np.where(free, cost, np.inf)))
                error = float(self.ANGLES[best])
                break
        if error is None:
            return 0.0, 0.6  # look around
        if abs(math.remainder(error - bearing, math.tau)) < math.radians(5.0):
            error = bearing  # between two angles
        self.course = heading + error
        turn = max(-1.8, min(1.8, 2.5 * error))
        speed = max(0.0, most * (1.0 - abs(error) / 0.7))
        speed = min(speed, most, 1.5 * distance, max(0.0, 1.5 * (self.clearance() - 0.28)))
        return speed, turn


class Driver(Node):
    """Drives to the pose in the last message on `route`; stands if it is empty, or if the courier says nothing any more."""

    SILENCE = 10  # messages on `odom` without one on `route`: half a second of the world

    def __init__(self) -> None:
        super().__init__("driver")
        self.declare_parameter("max_speed", 0.8, ParameterDescriptor(dynamic_typing=True))
        self.pilot = Pilot()
        self.target: Optional[Tuple[float, float]] = None
        self.silent = 0
        self.seen = False
        self.wheels = self.create_publisher(Twist, "cmd_vel", 10)
        self.create_subscription(LaserScan, "scan", self.on_scan, qos_profile_sensor_data)
        self.create_subscription(PoseArray, "route", self.on_route, 10)
        self.create_subscription(Odometry, "odom", self.on_odom, qos_profile_sensor_data)

    def on_scan(self, scan: LaserScan) -> None:
        self.pilot.see(scan)
        self.seen = True

    def on_route(self, route: PoseArray) -> None:
        self.silent = 0
        target = (route.poses[0].position.x, route.poses[0].position.y) if route.poses else None
        if target != self.target:
            self.target = target
            self.pilot.forget()

    def on_odom(self, odom: Odometry) -> None:
        self.silent += 1
        if self.silent > self.SILENCE and self.target is not None:
            self.get_logger().warning("the courier says nothing, the car stands")
            self.target = None
        command = Twist()
        if self.target is not None and self.seen:
            pose = odom.pose.pose
            most = float(self.get_parameter("max_speed").value)
            command.linear.x, command.angular.z = self.pilot.steer(
                pose.position.x, pose.position.y, heading_of(pose.orientation), self.target, most
            )
        self.wheels.publish(command)


def main():
    rclpy.init()
    try:
        rclpy.spin(Driver())
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        rclpy.try_shutdown()


if __name__ == "__main__":
    main()
