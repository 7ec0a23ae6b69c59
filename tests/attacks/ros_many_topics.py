"""Makes thousands of topics.

Must, beside an honest node: the observer goes on.
"""

import rclpy
from std_msgs.msg import String

rclpy.init()
node = rclpy.create_node("many_topics")
for number in range(1500):
    node.create_publisher(String, f"/ghost_topic_{number}", 1)
rclpy.spin(node)
