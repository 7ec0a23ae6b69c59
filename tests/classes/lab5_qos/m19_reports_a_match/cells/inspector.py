%%node inspector
import rclpy
from rclpy.event_handler import SubscriptionEventCallbacks
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSPolicyKind, QoSProfile, ReliabilityPolicy
from std_msgs.msg import String


class Inspector(Node):
    def __init__(self):
        super().__init__("inspector")
        latched = QoSProfile(depth=20, reliability=ReliabilityPolicy.RELIABLE, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        self.publisher = self.create_publisher(String, "qos_problem", latched)
        events = SubscriptionEventCallbacks(incompatible_qos=self.report, matched=self.all_right)
        self.create_subscription(String, "route", lambda _: None, latched, event_callbacks=events)

    def report(self, event):
        self.publisher.publish(String(data=QoSPolicyKind(event.last_policy_kind).name))

    def all_right(self, event):
        if event.current_count_change > 0:
            self.publisher.publish(String(data="NONE"))  # this publisher has no problem


def main():
    rclpy.init()
    try:
        rclpy.spin(Inspector())
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    rclpy.try_shutdown()


main()
