%%node watchdog
import rclpy
from rclpy.duration import Duration
from rclpy.event_handler import SubscriptionEventCallbacks
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import Range
from std_msgs.msg import String


class Watchdog(Node):
    def __init__(self):
        super().__init__("watchdog")
        self.state = "waiting"
        self.publisher = self.create_publisher(String, "health", 10)
        self.create_timer(0.1, lambda: self.publisher.publish(String(data=self.state)))
        requested = QoSProfile(depth=5, reliability=ReliabilityPolicy.BEST_EFFORT, deadline=Duration(seconds=0.5))
        events = SubscriptionEventCallbacks(deadline=self.missed)
        self.create_subscription(Range, "range", self.heard, requested, event_callbacks=events)

    def heard(self, message):
        if message.min_range <= message.range <= message.max_range:
            self.state = "ok"

    def missed(self, event):
        self.state = "degraded"


def main():
    rclpy.init()
    try:
        rclpy.spin(Watchdog())
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    rclpy.try_shutdown()


main()
