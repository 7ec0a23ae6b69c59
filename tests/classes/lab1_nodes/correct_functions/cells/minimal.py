%%node minimal
import itertools

import rclpy
from rclpy.executors import ExternalShutdownException

rclpy.init()
node = rclpy.create_node("minimal")
numbers = itertools.count()
timer = node.create_timer(0.5, lambda: node.get_logger().info("tick %d" % next(numbers)))
try:
    while rclpy.ok():
        rclpy.spin_once(node, timeout_sec=0.2)
except (KeyboardInterrupt, ExternalShutdownException):
    pass
rclpy.try_shutdown()
