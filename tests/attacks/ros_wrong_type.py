"""Publishes another type on the topic that is recorded, and forges the bytes of a message.

Must, beside an honest node: the observer goes on.
"""

import time

import rclpy
from std_msgs.msg import Int32, String

rclpy.init()
node = rclpy.create_node("wrong_type")
number = node.create_publisher(Int32, "/flood", 10)
text = node.create_publisher(String, "/flood", 10)
while True:
    number.publish(Int32(data=-1))
    for forged in (
        b"",
        b"\x00\x01\x00\x00\xff\xff\xff\xff",
        b"\xff" * 64,
        b"\x00\x01\x00\x00\x05\x00\x00\x00\xff\xfe\xfd\xfc\x00",
    ):
        text.publish(forged)
    time.sleep(0.01)
