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



rclpy.init()
node = rclpy.create_node("square")
seen = []
node.create_subscription(Odometry, "odom", seen.append, 1)
wheels = node.create_publisher(Twist, "cmd_vel", 1)
try:
    for goal in (SHOP, SCHOOL, PARK, HOME):
        while True:
            rclpy.spin_once(node)
            if not seen:
                continue
            metres, turn = way_to(goal, seen.pop())
            seen.clear()
            if metres < 0.1:
                break
            command = Twist()
            command.angular.z = turn
            command.linear.x = 0.4 if abs(turn) < 0.4 else 0.0
            wheels.publish(command)
    while rclpy.ok():
        rclpy.spin_once(node)
        wheels.publish(Twist())
except (KeyboardInterrupt, ExternalShutdownException):
    pass
finally:
    rclpy.try_shutdown()
