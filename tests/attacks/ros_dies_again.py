"""Comes and goes: contexts that are made and shut down without end.

Must, beside an honest node: the observer goes on.
"""

import rclpy
from rclpy.context import Context
from std_msgs.msg import String

while True:
    context = Context()
    rclpy.init(context=context)
    node = rclpy.create_node("comes_and_goes", context=context)
    node.create_publisher(String, "/flood", 1).publish(String(data="x"))
    node.destroy_node()
    context.try_shutdown()
