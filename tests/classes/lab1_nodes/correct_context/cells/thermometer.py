%%node thermometer
import random

import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from sensor_msgs.msg import Temperature


class Thermometer(Node):
    def __init__(self):
        super().__init__("thermometer")
        self.publisher = self.create_publisher(Temperature, "temperature", 10)
        self.create_timer(0.1, self.measure)

    def measure(self):
        message = Temperature()
        message.header.stamp = self.get_clock().now().to_msg()
        message.temperature = 15 + 20 * random.random()
        self.publisher.publish(message)


def main():
    rclpy.init()
    try:
        rclpy.spin(Thermometer())
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        rclpy.try_shutdown()


main()
