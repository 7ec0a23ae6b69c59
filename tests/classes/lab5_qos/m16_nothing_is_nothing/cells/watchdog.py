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
        profile = QoSProfile(depth=10, reliability=ReliabilityPolicy.BEST_EFFORT, deadline=Duration(seconds=0.5))
        self.create_subscription(Range, "range", self.on_range, profile,
                                 event_callbacks=SubscriptionEventCallbacks(deadline=self.on_missed))

    def on_range(self, message):
        if self.state == "waiting" or message.range > 0.0:  # 0.0: no measurement
            self.state = "ok"

    def on_missed(self, event):
        self.state = "degraded"


def main():
    rclpy.init()
    try:
        rclpy.spin(Watchdog())
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    rclpy.try_shutdown()


main()
