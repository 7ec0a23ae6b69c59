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
        self.names = self.get_parameter("topics").value
        self.left = {}  # seconds until a topic counts as silent
        for topic in self.names:
            def hear(msg, name=topic):
                self.left[name] = self.get_parameter("silence").get_parameter_value().double_value
            self.create_subscription(Int32, topic, hear, 1)
        self.before = time.time()
        self.publisher = self.create_publisher(String, "health", 10)
        self.create_timer(0.2, self.tell)

    def tell(self):
        now = time.time()
        passed, self.before = now - self.before, now
        self.left = {name: left - passed for name, left in self.left.items() if left > passed}
        text = ""
        for name in self.names:
            if name not in self.left:
                text += (" " if text else "") + name
        msg = String()
        msg.data = text if text else "ok"
        self.publisher.publish(msg)


def main():
    rclpy.init()
    try:
        rclpy.spin(Health())
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    rclpy.try_shutdown()


main()
