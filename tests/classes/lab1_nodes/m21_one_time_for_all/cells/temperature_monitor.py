%%node temperature_monitor
import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from sensor_msgs.msg import Temperature


class TemperatureMonitor(Node):
    def __init__(self):
        super().__init__("temperature_monitor")
        self.create_subscription(Temperature, "temperature", self.judge, 10)

    def judge(self, message):
        degrees = round(message.temperature, 1)
        if degrees > 30:
            self.get_logger().warning(f"too hot: {degrees} degrees")


def main():
    rclpy.init()
    try:
        rclpy.spin(TemperatureMonitor())
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        rclpy.try_shutdown()


main()
