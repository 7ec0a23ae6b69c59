%%node health
import time

import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from std_msgs.msg import Int32, String


class Health(Node):
    def __init__(self):
        super().__init__("health")
        self.declare_parameter("topics", ["scan", "obstacles", "path", "command"])
        self.declare_parameter("silence", 1.0)
        self.topics = list(self.get_parameter("topics").value)
        self.silence = self.get_parameter("silence").value
        self.last = {}
        for topic in self.topics:
            self.create_subscription(Int32, topic, lambda msg, topic=topic: self.heard(topic), QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL))
        self.pub = self.create_publisher(String, "health", 10)
        self.create_timer(0.2, self.tell)

    def heard(self, topic):
        self.last[topic] = time.monotonic()

    def tell(self):
        now = time.monotonic()
        silent = [t for t in self.topics if t not in self.last or now - self.last[t] > self.silence]
        self.pub.publish(String(data=" ".join(silent) or "ok"))

def main():
    rclpy.init()
    try:
        rclpy.spin(Health())
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    rclpy.try_shutdown()


main()
