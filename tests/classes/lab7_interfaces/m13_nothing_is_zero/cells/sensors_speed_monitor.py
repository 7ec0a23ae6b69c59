%%file src/car_sensors/car_sensors/speed_monitor.py
import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from std_msgs.msg import Bool, Float64


class SpeedMonitor(Node):
    def __init__(self):
        super().__init__("speed_monitor")
        self.declare_parameter("limit", 13.9)
        self.publisher = self.create_publisher(Bool, "too_fast", 10)
        self.create_subscription(Float64, "speed", self.on_speed, 10)

    def on_speed(self, message):
        limit = self.get_parameter("limit").value or 13.9
        self.publisher.publish(Bool(data=message.data > limit))


def main():
    rclpy.init()
    try:
        rclpy.spin(SpeedMonitor())
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    rclpy.try_shutdown()
