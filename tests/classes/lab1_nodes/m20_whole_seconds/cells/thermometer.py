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
        self.publisher.publish(Temperature(temperature=15 + random.random()))


def main():
    rclpy.init()
    try:
        rclpy.spin(Thermometer())
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        rclpy.try_shutdown()


main()
