%%file src/car_sensors/car_sensors/speed_monitor.py
import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from std_msgs.msg import Bool, Float64

import queue
import threading

from rcl_interfaces.msg import FloatingPointRange, ParameterDescriptor

END = object()


class SpeedMonitor(Node):
    """Ein Arbeiter-Thread schreibt, damit der Callback kurz bleibt."""

    def __init__(self):
        super().__init__("speed_monitor")
        description = ParameterDescriptor(
            description="m/s", floating_point_range=[FloatingPointRange(from_value=0.0, to_value=200.0, step=0.0)])
        self.limit = self.declare_parameter("limit", 13.9, description).value
        self.results = self.create_publisher(Bool, "too_fast", 10)
        self.inbox = queue.SimpleQueue()
        self.create_subscription(Float64, "speed", self.inbox.put, 10)
        self.worker = threading.Thread(target=self.work, daemon=True)

    def work(self):
        for message in iter(self.inbox.get, END):
            self.results.publish(Bool(data=not message.data <= self.limit))


def main():
    rclpy.init()
    node = SpeedMonitor()
    node.worker.start()
    try:
        rclpy.spin(node)
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        node.inbox.put(END)
        node.worker.join()
        rclpy.try_shutdown()
