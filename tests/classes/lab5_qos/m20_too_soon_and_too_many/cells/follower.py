%%node follower
import threading

import rclpy
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup
from rclpy.executors import ExternalShutdownException, MultiThreadedExecutor
from rclpy.node import Node
from rclpy.time import Time
from std_msgs.msg import Float64, Header


class Follower(Node):
    def __init__(self):
        super().__init__("follower")
        self.work = self.declare_parameter("work", 0.05).value
        self.publisher = self.create_publisher(Float64, "age", 10)
        self.waiting = []
        self.lock = threading.Lock()
        self.work_over = threading.Event()  # nothing sets it: the work takes its whole time
        self.create_subscription(Header, "frames", self.take, 100, callback_group=MutuallyExclusiveCallbackGroup())
        self.create_timer(0.005, self.steer, callback_group=MutuallyExclusiveCallbackGroup())

    def take(self, frame):
        with self.lock:
            self.waiting.append(frame)

    def steer(self):
        with self.lock:
            if not self.waiting:
                return
            if len(self.waiting) > 2:  # it cannot keep up: only the newest counts
                del self.waiting[:-1]
            frame = self.waiting.pop(0)
        age = self.get_clock().now() - Time.from_msg(frame.stamp)
        self.publisher.publish(Float64(data=age.nanoseconds / 1e9))
        self.work_over.wait(self.work)


def main():
    rclpy.init()
    executor = MultiThreadedExecutor(num_threads=3)
    executor.add_node(Follower())
    try:
        executor.spin()
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    rclpy.try_shutdown()


main()
