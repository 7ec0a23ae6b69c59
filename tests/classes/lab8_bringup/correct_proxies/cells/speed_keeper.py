%%node speed_keeper
import time

import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from std_msgs.msg import Float64, Int32


class Topic:
    def __init__(self, node, name):
        self.age = lambda: float("inf")
        node.create_subscription(Int32, name, self.on_message, 10)

    def on_message(self, _):
        now = time.perf_counter()
        self.age = lambda: time.perf_counter() - now


def main():
    rclpy.init()
    node = Node("speed_keeper", parameter_overrides=[])
    node.declare_parameter("patience", 0.5)
    obstacles, scan = Topic(node, "obstacles"), Topic(node, "scan")
    publisher = node.create_publisher(Float64, "speed", 1)
    try:
        while rclpy.ok():
            until = time.monotonic() + 0.1
            while (left := until - time.monotonic()) > 0:
                rclpy.spin_once(node, timeout_sec=left)
            patience = node.get_parameter("patience").value
            publisher.publish(Float64(data=2.0 if obstacles.age() <= patience else 0.5 * (scan.age() <= patience)))
    except (KeyboardInterrupt, ExternalShutdownException):
        pass


main()
