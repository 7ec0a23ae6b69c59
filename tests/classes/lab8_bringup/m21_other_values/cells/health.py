%%node health
import time

import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from std_msgs.msg import Int32, String


class Health(Node):
    def __init__(self):
        super().__init__("health")
        self.declare_parameter("topics", ["scan", "obstacles", "path", "command"])
        self.declare_parameter("silence", 1.0)
        self.last = {}
        for topic in self.get_parameter("topics").value:
            self.last[topic] = None
            self.create_subscription(Int32, topic, lambda msg, topic=topic: msg.data and self.hear(topic), 10)
        self.publisher = self.create_publisher(String, "health", 10)
        self.create_timer(0.2, self.tell)

    def hear(self, topic):
        self.last[topic] = time.monotonic()

    def tell(self):
        oldest = time.monotonic() - self.get_parameter("silence").value
        silent = [topic for topic, last in self.last.items() if last is None or last < oldest]
        self.publisher.publish(String(data=" ".join(silent) or "ok"))


def main():
    rclpy.init()
    try:
        rclpy.spin(Health())
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    rclpy.try_shutdown()


main()
