import time

import rclpy
from rclpy.duration import Duration
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from rclpy.qos import LivelinessPolicy, QoSProfile
from std_msgs.msg import Int32, String


class Guard(Node):
    def __init__(self):
        super().__init__("guard")
        self.state = "waiting"
        self.publisher = self.create_publisher(String, "controller_state", 10)
        self.create_timer(0.1, lambda: self.publisher.publish(String(data=self.state)))
        request = QoSProfile(
            depth=1, liveliness=LivelinessPolicy.MANUAL_BY_TOPIC, liveliness_lease_duration=Duration(seconds=0.6)
        )
        self.last = None  # when the last number came
        self.create_subscription(Int32, "steering", self.on_number, request)
        self.create_timer(0.1, self.look)

    def on_number(self, number):
        self.last = time.monotonic()
        self.state = "alive"

    def look(self):
        if self.last is not None and time.monotonic() - self.last > 0.6:
            self.state = "lost"


def main():
    rclpy.init()
    try:
        rclpy.spin(Guard())
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    rclpy.try_shutdown()


main()
