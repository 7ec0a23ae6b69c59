"""Floods a recorded topic with small messages as fast as it can.

Must, beside an honest node: the observer goes on.
"""

import rclpy
from std_msgs.msg import String

rclpy.init()
node = rclpy.create_node("small")
publisher = node.create_publisher(String, "/flood", 1000)
message = String(data="x")
while True:
    publisher.publish(message)
