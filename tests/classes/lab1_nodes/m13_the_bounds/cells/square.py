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
        self.places = [SHOP, SCHOOL, PARK, HOME]
        self.wheels = self.create_publisher(Twist, "cmd_vel", 10)
        self.create_subscription(Odometry, "odom", self.drive, 10)

    def drive(self, odometry):
        command = Twist()
        if self.places:
            metres, turn = way_to(self.places[0], odometry)
            command.linear.x = 0.6 if abs(turn) < 0.3 else 0.0
            command.angular.z = 2.0 * turn
            if metres < (0.15 if len(self.places) > 1 else 0.7):
                self.places.pop(0)
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
