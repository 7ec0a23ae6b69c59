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
        self.last = dict.fromkeys(self.get_parameter("topics").value)
        self.subs = [self.create_subscription(Int32, t, (lambda name: lambda msg: self.hear(name))(t), 10) for t in self.last]
        self.publisher = self.create_publisher(String, "health", 10)
        self.create_timer(0.2, self.tell)

    def hear(self, topic):
        self.last[topic] = time.monotonic()

    def tell(self):
        limit = self.get_parameter("silence").value

        def is_silent(topic):
            try:
                return time.monotonic() - self.last[topic] > limit
            except TypeError:
                return True

        self.publisher.publish(String(data=" ".join(filter(is_silent, self.last)) or "ok"))


def main():
    rclpy.init()
    try:
        rclpy.spin(Health())
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    rclpy.try_shutdown()


main()
