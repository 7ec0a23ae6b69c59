%%node square
import math

import rclpy
from geometry_msgs.msg import Twist
from nav_msgs.msg import Odometry
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node

HOME, SHOP, SCHOOL, PARK = (1.1, 1.1), (2.5, 1.1), (2.5, 2.5), (1.1, 2.5)  # the middles of the places: x and y in metres


def way_to(place, odometry):
    """Return the metres to a place, and the radians by which the car has to turn to look at it (to the left if positive)."""
    pose = odometry.pose.pose
    x, y = place[0] - pose.position.x, place[1] - pose.position.y
    heading = 2 * math.atan2(pose.orientation.z, pose.orientation.w)
    return math.hypot(x, y), math.remainder(math.atan2(y, x) - heading, math.tau)


class Square(Node):
    def __init__(self):
        super().__init__("square")
        # turns to east, north, west, south and drives until x or y is far enough
        self.wheels = self.create_publisher(Twist, "cmd_vel", 10)
        self.legs = [(0.0, lambda x, y: x >= 2.4), (math.pi / 2, lambda x, y: y >= 2.4), (math.pi, lambda x, y: x <= 1.2), (-math.pi / 2, lambda x, y: y <= 1.2)]
        self.turning = True
        self.create_subscription(Odometry, "odom", self.drive, 10)

    def drive(self, odometry):
        command = Twist()
        if self.legs:
            wanted, there = self.legs[0]
            pose = odometry.pose.pose
            heading = 2 * math.atan2(pose.orientation.z, pose.orientation.w)
            turn = math.remainder(wanted - heading, math.tau)
            if self.turning:
                command.angular.z = 1.5 * turn
                self.turning = abs(turn) > 0.03
            elif there(pose.position.x, pose.position.y):
                self.legs.pop(0)
                self.turning = True
            else:
                command.linear.x = 0.5
                command.angular.z = turn
        self.wheels.publish(command)


def main():
    rclpy.init()
    try:
        rclpy.spin(Square())
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        rclpy.try_shutdown()


main()
