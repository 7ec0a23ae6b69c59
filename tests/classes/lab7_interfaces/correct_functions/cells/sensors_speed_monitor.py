from functools import partial

import rclpy
from rclpy.node import Node
from std_msgs.msg import Bool, Float64


def watch(node, out, message):
    answer = Bool()
    answer.data = not message.data <= node.get_parameter("limit").get_parameter_value().double_value
    out.publish(answer)


def main():
    rclpy.init()
    node = Node("speed_monitor")
    node.declare_parameter("limit", 13.9)
    node.create_subscription(Float64, "speed", partial(watch, node, node.create_publisher(Bool, "too_fast", 5)), 5)
    while rclpy.ok():
        rclpy.spin_once(node, timeout_sec=1.0)
