"""Makes as many nodes as its limits let it, without end.

Must, beside an honest node: the observer goes on.
"""

import time

import rclpy

rclpy.init()
nodes = []
try:
    while len(nodes) < 60:
        nodes.append(rclpy.create_node(f"ghost_{len(nodes)}", start_parameter_services=False))
finally:
    time.sleep(30)
