%%node temperature_monitor
import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from rclpy.qos import qos_profile_sensor_data
from sensor_msgs.msg import Temperature


class TemperatureMonitor(Node):
    def __init__(self):
        super().__init__("temperature_monitor")
        self.before = None
        self.create_subscription(Temperature, "temperature", self.judge, 10)

    def judge(self, message):
        """Warn, and say in the German way of writing numbers what it was before."""
        now, before, self.before = message.temperature, self.before, message.temperature
        if now > 30.0:
            since = "" if before is None else f" (vorher {before:.1f}; Grenze 30.0)"
            self.get_logger().warning(f"zu heiß: {now:.1f}{since}".replace(".", ","))


def main():
    rclpy.init()
    try:
        rclpy.spin(TemperatureMonitor())
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        rclpy.try_shutdown()


main()
