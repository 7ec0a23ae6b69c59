%%node announcer
"""Waits in main, without any timer: a loop that spins a little and looks."""
import rclpy
from std_msgs.msg import String


def main():
    rclpy.init()
    node = rclpy.create_node("announcer")
    node.declare_parameter("text", "ready")
    publisher = node.create_publisher(String, "announcement", 10)
    while rclpy.ok() and not publisher.get_subscription_count():
        rclpy.spin_once(node, timeout_sec=0.05)
    publisher.publish(String(data=node.get_parameter("text").get_parameter_value().string_value))
    rclpy.spin(node)


if __name__ == "__main__":
    main()
