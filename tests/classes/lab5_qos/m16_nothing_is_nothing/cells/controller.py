%%node controller
import time

import rclpy
from rclpy.duration import Duration
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from rclpy.qos import LivelinessPolicy, QoSProfile
from std_msgs.msg import Bool, Int32


class Controller(Node):
    def __init__(self):
        super().__init__("controller")
        self.number = 0
        self.frozen = False
        self.create_subscription(Bool, "freeze", self.freeze, 10)
        profile = QoSProfile(depth=10, liveliness=LivelinessPolicy.MANUAL_BY_TOPIC, liveliness_lease_duration=Duration(seconds=0.4))
        self.publisher = self.create_publisher(Int32, "steering", profile)
        self.began = time.monotonic()
        self.create_timer(0.1, self.steer)

    def freeze(self, message):
        self.frozen = message.data

    def steer(self):
        if self.frozen:
            return
        due = int((time.monotonic() - self.began) * 10)
        while self.number < due:
            self.publisher.publish(Int32(data=self.number))
            self.number += 1


def main():
    rclpy.init()
    try:
        rclpy.spin(Controller())
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    rclpy.try_shutdown()


main()
