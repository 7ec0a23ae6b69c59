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
        self.topics = self.get_parameter("topics").value
        self.silence = self.get_parameter("silence").value
        self.last = {}
        for topic in self.topics:
            self.create_subscription(Int32, topic, lambda msg, topic=topic: self.hear(topic), 10)
        self.publisher = self.create_publisher(String, "health", 10)
        self.create_timer(0.2, self.report)

    def is_silent(self, topic):
        return topic not in self.last or time.monotonic() - self.last[topic] > self.silence

    def hear(self, topic):
        self.last[topic] = time.monotonic()
        self.report()

    def report(self):
        silent = [topic for topic in self.topics if self.is_silent(topic)]
        self.publisher.publish(String(data=" ".join(silent) if silent else "ok"))


def main():
    rclpy.init()
    try:
        rclpy.spin(Health())
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    rclpy.try_shutdown()


main()
