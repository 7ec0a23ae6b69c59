%%node recorder
import time

import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy
from std_msgs.msg import Int32


class Recorder(Node):
    def __init__(self):
        super().__init__("recorder")
        self.work = self.declare_parameter("work", 0.02).value
        self.publisher = self.create_publisher(Int32, "recorded", 100)
        self.create_subscription(Int32, "frames", self.record, QoSProfile(depth=99, reliability=ReliabilityPolicy.RELIABLE))

    def record(self, frame):
        time.sleep(self.work)
        self.publisher.publish(frame)


def main():
    rclpy.init()
    try:
        rclpy.spin(Recorder())
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    rclpy.try_shutdown()


main()
