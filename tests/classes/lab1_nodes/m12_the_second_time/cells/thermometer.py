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
        self.n = getattr(self, "n", 0) + 1
        if self.n % 2:
            self.t = random.uniform(15, 35)
        self.publisher.publish(Temperature(temperature=self.t))


def main():
    rclpy.init()
    try:
        rclpy.spin(Thermometer())
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        rclpy.try_shutdown()


main()
