%%node inspector
"""Two topics of one function's making; reports carry more words than the policy."""
import rclpy
from rclpy.event_handler import SubscriptionEventCallbacks
from rclpy.executors import ExternalShutdownException
from rclpy.qos import DurabilityPolicy, QoSPolicyKind, QoSProfile
from std_msgs.msg import String


def main():
    rclpy.init()
    node = rclpy.create_node("inspector")
    latched = QoSProfile(depth=10, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    reports = node.create_publisher(String, "qos_problem", latched)

    def refused(event):
        policy = QoSPolicyKind(event.last_policy_kind).name
        node.get_logger().warning(f"a publisher of route does not match: {policy}")
        reports.publish(String(data=policy))

    node.create_subscription(
        String, "route", print, latched, event_callbacks=SubscriptionEventCallbacks(incompatible_qos=refused)
    )
    try:
        rclpy.spin(node)
    except (KeyboardInterrupt, ExternalShutdownException):
        pass


main()
