%%file src/car_sensors/car_sensors/speed_monitor.py
import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from std_msgs.msg import Bool, Float64


class SpeedMonitor(Node):
    def __init__(self):
        super().__init__("speed_monitor")
        self.limit = self.declare_parameter("limit", 13.9)
        self.too_fast = False
        self.publisher = self.create_publisher(Bool, "too_fast", 10)
        self.create_subscription(Float64, "speed", self.on_speed, 10)

    def on_speed(self, message):
        limit = self.limit.value
        if message.data > limit:
            self.too_fast = True
        elif message.data < limit - 0.5 or not self.too_fast:
            self.too_fast = False  # not at once, otherwise the lamp flickers
        self.publisher.publish(Bool(data=self.too_fast))


def main():
    rclpy.init()
    try:
        rclpy.spin(SpeedMonitor())
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    rclpy.try_shutdown()
