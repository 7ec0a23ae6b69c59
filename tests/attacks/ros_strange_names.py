"""Makes nodes and topics with names of every length that rcl lets pass.

Must, beside an honest node: the observer goes on.
"""

import rclpy
from std_msgs.msg import String

rclpy.init()
node = rclpy.create_node("n" * 200, namespace="/" + "/".join("s" * 20 for _ in range(10)))
for length in (1, 100, 240):
    try:
        node.create_publisher(String, "/" + "t" * length, 1)
    except Exception as error:
        print(type(error).__name__)
rclpy.spin(node)
