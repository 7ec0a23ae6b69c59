"""Declares thousands of parameters with long values, and changes them all the time.

Must, beside an honest node: the observer goes on.
"""

import rclpy
from rclpy.parameter import Parameter

rclpy.init()
node = rclpy.create_node("huge_parameters")
for number in range(1000):
    node.declare_parameter(f"p{number}", "x" * 1000)
while True:
    for number in range(1000):
        node.set_parameters([Parameter(f"p{number}", value="y" * 1000)])
