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
        for topic in self.last:
            self.create_subscription(Int32, topic, lambda _, topic=topic: self.last.update({topic: time.time()}), 10)
        self.publisher = self.create_publisher(String, "health", 10)
        self.create_timer(0.2, self.tell)

    def is_silent(self, topic):
        if self.last[topic] is None:
            return True
        return int(time.time() - self.last[topic]) > self.get_parameter("silence").value

    def tell(self):
        self.publisher.publish(String(data=" ".join(filter(self.is_silent, self.last)) or "ok"))


def main():
    rclpy.init()
    try:
        rclpy.spin(Health())
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    rclpy.try_shutdown()


main()
