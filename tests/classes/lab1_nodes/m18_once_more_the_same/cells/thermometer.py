%%node thermometer
import itertools
import random

import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from sensor_msgs.msg import Temperature


class Thermometer(Node):
    def __init__(self):
        super().__init__("thermometer")
        self.numbers = itertools.count()
        self.publisher = self.create_publisher(Temperature, "temperature", 10)
        self.create_timer(0.1, self.publish)

    def publish(self):
        if next(self.numbers) % 5 != 4:  # the sensor measures eight times a second only
            self.value = random.uniform(15, 35)
        self.publisher.publish(Temperature(temperature=self.value))


def main():
    rclpy.init()
    try:
        rclpy.spin(Thermometer())
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        rclpy.try_shutdown()


main()
