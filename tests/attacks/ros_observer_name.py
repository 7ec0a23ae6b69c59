"""Takes the observer's own name, as soon as it can be read off the graph.

Must, beside an honest node: the observer goes on.
"""

import rclpy

rclpy.init()
node = rclpy.create_node("looks")
found = ""
while not found:
    rclpy.spin_once(node, timeout_sec=0.1)
    found = next((name for name in node.get_node_names() if "observer" in name), "")
rclpy.spin(rclpy.create_node(found))
