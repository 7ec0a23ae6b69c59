%%node watchdog
import time

import rclpy
from rclpy.duration import Duration
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import Range
from std_msgs.msg import String


class Watchdog(Node):
    def __init__(self):
        super().__init__("watchdog")
        self.last = None
        self.publisher = self.create_publisher(String, "health", 10)
        self.create_timer(0.1, self.tell)
        profile = QoSProfile(depth=5, reliability=ReliabilityPolicy.BEST_EFFORT, deadline=Duration(seconds=0.5))
        self.create_subscription(Range, "range", self.take, profile)

    def take(self, _):
        self.last = time.monotonic()

    def tell(self):
        if self.last is None:
            state = "waiting"
        elif time.monotonic() - self.last > 0.2:  # four measurements are missing
            state = "degraded"
        else:
            state = "ok"
        self.publisher.publish(String(data=state))


def main():
    rclpy.init()
    try:
        rclpy.spin(Watchdog())
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    rclpy.try_shutdown()


main()
