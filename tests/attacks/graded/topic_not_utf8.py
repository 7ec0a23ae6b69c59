"""Makes a topic below ROS whose name is no UTF-8.

Must: forged-graph.
"""

import time

import rclpy
from _rmw import publisher

rclpy.init()
node = rclpy.create_node("talker")
publish = publisher(node, b"rt/\xff\xfe<script>", "std_msgs", "String")
time.sleep(1000)
