"""Floods a recorded topic with messages of 60 kilobytes, and some of many megabytes.

Must, beside an honest node: the observer goes on.
"""

import rclpy
from std_msgs.msg import String

rclpy.init()
node = rclpy.create_node("huge")
publisher = node.create_publisher(String, "/flood", 10)
for number in range(10**6):
    publisher.publish(String(data="x" * (8_000_000 if number % 1000 == 999 else 60_000)))
