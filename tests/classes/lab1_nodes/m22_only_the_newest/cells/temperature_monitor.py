%%node temperature_monitor
import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from sensor_msgs.msg import Temperature


class TemperatureMonitor(Node):
    def __init__(self):
        super().__init__("temperature_monitor")
        self.newest = None
        self.create_subscription(Temperature, "temperature", self.take, 10)
        self.create_timer(0.1, self.judge)  # as often as the thermometer measures

    def take(self, message):
        self.newest = message.temperature

    def judge(self):
        if self.newest is not None and self.newest > 30:
            self.get_logger().warning(f"too hot: {self.newest:.1f} degrees")
        self.newest = None


def main():
    rclpy.init()
    try:
        rclpy.spin(TemperatureMonitor())
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        rclpy.try_shutdown()


main()
