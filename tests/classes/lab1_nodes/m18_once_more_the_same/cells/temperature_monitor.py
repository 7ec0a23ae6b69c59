%%node temperature_monitor
import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from sensor_msgs.msg import Temperature


class TemperatureMonitor(Node):
    def __init__(self):
        super().__init__("temperature_monitor")
        self.last = None
        self.create_subscription(Temperature, "temperature", self.on_temperature, 10)

    def on_temperature(self, msg):
        degrees = msg.temperature
        if degrees == self.last:
            return  # nothing new
        self.last = degrees
        if degrees > 30.0:
            self.get_logger().warn(f"too hot: {degrees:.2f}")


def main():
    rclpy.init()
    try:
        rclpy.spin(TemperatureMonitor())
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        rclpy.try_shutdown()


main()
