%%file src/car_sensors/car_sensors/speed_monitor.py
import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from std_msgs.msg import Bool, Float64


class SpeedMonitor(Node):
    def __init__(self):
        super().__init__("speed_monitor")
        self.limit = self.declare_parameter("limit", 13.9).value
        self.publisher = self.create_publisher(Bool, "too_fast", 10)
        self.speed = None
        self.create_subscription(Float64, "speed", self.note, 10)
        self.create_timer(0.5, self.compare)

    def note(self, message):
        self.speed = message.data

    def compare(self):
        if self.speed is not None:
            self.publisher.publish(Bool(data=self.speed > self.limit))
            self.speed = None


def main():
    rclpy.init()
    try:
        rclpy.spin(SpeedMonitor())
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    rclpy.try_shutdown()
