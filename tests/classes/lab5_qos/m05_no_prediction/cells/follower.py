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
        now = self.get_clock().now().to_msg()
        self.publisher.publish(Float64(data=float(now.sec - frame.stamp.sec)))
        time.sleep(self.work)


def main():
    rclpy.init()
    try:
        rclpy.spin(Follower())
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    rclpy.try_shutdown()


main()
