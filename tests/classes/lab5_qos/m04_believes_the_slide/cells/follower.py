%%node follower
import time

import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from rclpy.time import Time
from std_msgs.msg import Float64, Header


class Follower(Node):
    def __init__(self):
        super().__init__("follower")
        self.work = self.declare_parameter("work", 0.05).value
        self.publisher = self.create_publisher(Float64, "age", 10)
        self.create_subscription(Header, "frames", self.follow, 1)

    def follow(self, frame):
        time.sleep(self.work)
        age = self.get_clock().now() - Time.from_msg(frame.stamp)
        self.publisher.publish(Float64(data=age.nanoseconds / 1e9))


def main():
    rclpy.init()
    try:
        rclpy.spin(Follower())
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    rclpy.try_shutdown()


main()
