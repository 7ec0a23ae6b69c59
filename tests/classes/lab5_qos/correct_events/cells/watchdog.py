%%node watchdog
"""Several threads; the state is told when it changes as well as ten times a second."""
import threading

import rclpy
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.duration import Duration
from rclpy.event_handler import SubscriptionEventCallbacks
from rclpy.executors import ExternalShutdownException, MultiThreadedExecutor
from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import Range
from std_msgs.msg import String


class Watchdog(Node):
    def __init__(self):
        super().__init__("watchdog")
        self.group = ReentrantCallbackGroup()
        self.lock = threading.Lock()
        self.state = "waiting"
        self.publisher = self.create_publisher(String, "health", 10)
        profile = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)
        profile.deadline = Duration(nanoseconds=500_000_000)
        self.create_subscription(
            Range, "range", lambda _: self.change("ok"), profile, callback_group=self.group,
            event_callbacks=SubscriptionEventCallbacks(deadline=lambda _: self.change("degraded")),
        )
        self.create_timer(0.1, self.tell, callback_group=self.group)

    def change(self, state):
        with self.lock:
            changed, self.state = state != self.state, state
        if changed:
            self.tell()

    def tell(self):
        self.publisher.publish(String(data=self.state))


def main():
    rclpy.init()
    executor = MultiThreadedExecutor(num_threads=3)
    executor.add_node(Watchdog())
    try:
        executor.spin()
    except (KeyboardInterrupt, ExternalShutdownException):
        pass


main()
