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

    value = 15.0

    def next(self):
        self.value += 0.05
        return self.value

    def measure(self):
        self.publisher.publish(Temperature(temperature=self.next()))


def main():
    rclpy.init()
    try:
        rclpy.spin(Thermometer())
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        rclpy.try_shutdown()


main()
