%%file src/car_sensors/car_sensors/speed_monitor.py
import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from std_msgs.msg import Bool, Float64

from functools import partial
from operator import gt


def judge(node, out, message):
    limit = node.get_parameter("limit").value
    out.publish(Bool(data=gt(message.data, limit)))


def main():
    rclpy.init()
    node = rclpy.create_node("speed_monitor")
    node.declare_parameters("", [("limit", 13.9)])
    node.create_subscription(Float64, "speed", partial(judge, node, node.create_publisher(Bool, "too_fast", 10)), 10)
    try:
        rclpy.spin(node)
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    rclpy.try_shutdown()
