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
        self.ticks = 0
        self.publisher = self.create_publisher(String, "health", 10)
        self.create_timer(0.1, self.tell)
        profile = QoSProfile(depth=5, reliability=ReliabilityPolicy.BEST_EFFORT, deadline=Duration(seconds=0.5))
        events = SubscriptionEventCallbacks(deadline=self.missed)
        self.create_subscription(Range, "range", self.take, profile, event_callbacks=events)

    def tell(self):
        self.publisher.publish(String(data=self.state))
        if self.ticks:
            self.ticks -= 1

    def missed(self, event):
        self.state = "degraded"
        self.ticks = 0

    def take(self, _):
        if self.state == "degraded":
            self.state = "waiting"
            self.ticks = 5
        elif self.state == "waiting" and self.ticks == 0:
            self.state = "ok"


def main():
    rclpy.init()
    try:
        rclpy.spin(Watchdog())
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    rclpy.try_shutdown()


main()
