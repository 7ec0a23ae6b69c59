%%node temperature_monitor
import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from sensor_msgs.msg import Temperature


class TemperatureMonitor(Node):
    def __init__(self):
        super().__init__("temperature_monitor")
        self.create_subscription(Temperature, "temperature", self.judge, 10)
        self.was_hot = False

    def judge(self, msg):
        hot = msg.temperature > 30.0
        if hot:
            self.get_logger().warning(f"too hot: {msg.temperature:.1f}")
        elif self.was_hot:
            self.get_logger().warning("cool again")
        self.was_hot = hot


def main():
    rclpy.init()
    try:
        rclpy.spin(TemperatureMonitor())
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        rclpy.try_shutdown()


main()
