"""Publishes a clock that jumps back and forth.

Must, beside an honest node: the observer goes on.
"""

import random
import time

import rclpy
from rosgraph_msgs.msg import Clock

rclpy.init()
node = rclpy.create_node("mad_clock")
publisher = node.create_publisher(Clock, "/clock", 10)
while True:
    message = Clock()
    message.clock.sec = random.randrange(-(2**31), 2**31)
    publisher.publish(message)
    time.sleep(0.001)
