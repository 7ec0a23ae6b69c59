%%node minimal
import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node


class Minimal(Node):
    def __init__(self):
        super().__init__("minimal")
        self.number = 0
        self.create_timer(2.0, self.tick)  # 2 Hz

    def tick(self):
        self.get_logger().info(f"tick {self.number}")
        self.number += 1


def main():
    rclpy.init()
    try:
        rclpy.spin(Minimal())
    except (KeyboardInterrupt, ExternalShutdownException):
        rclpy.try_shutdown()


main()
