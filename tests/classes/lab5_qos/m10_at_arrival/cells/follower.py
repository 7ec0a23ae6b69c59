%%node follower
import threading
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
        self.waiting = None
        self.create_subscription(Header, "frames", self.keep, 1)
        threading.Thread(target=self.follow, daemon=True).start()

    def keep(self, frame):
        age = self.get_clock().now() - Time.from_msg(frame.stamp)
        self.waiting = age.nanoseconds / 1e9

    def follow(self):
        while True:
            age, self.waiting = self.waiting, None
            if age is None:
                time.sleep(0.005)
                continue
            self.publisher.publish(Float64(data=age))
            time.sleep(self.work)


def main():
    rclpy.init()
    try:
        rclpy.spin(Follower())
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    rclpy.try_shutdown()


main()
