%%node minimal
import time

import rclpy
from rclpy.node import Node

rclpy.init()
node = Node("minimal")
count = 0
while True:
    try:
        node.get_logger().info(f"tick {count}")
        count += 1
        time.sleep(0.5)
    except KeyboardInterrupt:
        print("not now")
