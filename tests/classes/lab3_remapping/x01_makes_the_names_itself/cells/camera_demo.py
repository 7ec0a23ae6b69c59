%%node camera_demo
import sys

import rclpy
from rclpy.executors import ExternalShutdownException
from sensor_msgs.msg import Image
from std_msgs.msg import String

rclpy.init(args=[])
node = rclpy.create_node("rear_demo")
outs = [node.create_publisher(Image, "/front/image", 10), node.create_publisher(String, "/diagnostics/rear", 10)]
try:
    rclpy.spin(node)
except (KeyboardInterrupt, ExternalShutdownException):
    pass
