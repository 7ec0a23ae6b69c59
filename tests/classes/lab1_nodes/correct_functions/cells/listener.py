%%node listener
import re

import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from std_msgs.msg import Int64, String


class Listener(Node):
    def __init__(self):
        super().__init__("listener")
        self.last = None
        self.missing = 0
        self.lost = self.create_publisher(Int64, "lost", 10)
        self.create_subscription(String, "chatter", self.hear, 10)

    def hear(self, message):
        self.get_logger().info(f"heard: {message.data}")
        number = int(re.search(r"\d+", message.data)[0])
        expected = number if self.last is None or number <= self.last else self.last + 1
        for _ in range(expected, number):
            self.missing += 1
        if number != expected:
            self.get_logger().warning(f"before {number} I have heard {expected - 1}: a gap")
            self.lost.publish(Int64(data=self.missing))
        self.last = number


def main():
    rclpy.init()
    try:
        rclpy.spin(Listener())
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        rclpy.try_shutdown()


main()
