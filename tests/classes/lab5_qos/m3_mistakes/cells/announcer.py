%%node announcer
import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from std_msgs.msg import String


LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)


class Announcer(Node):
    def __init__(self):
        super().__init__("announcer")
        self.declare_parameter("text", "ready")
        self.publisher = self.create_publisher(String, "announcement", LATCHED)
        self.publisher.publish(String(data=self.get_parameter("text").value))


def main():
    rclpy.init()
    try:
        rclpy.spin(Announcer())
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    rclpy.try_shutdown()


main()
