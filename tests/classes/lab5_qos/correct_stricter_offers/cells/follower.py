%%node follower
import threading
import time

import rclpy
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.executors import ExternalShutdownException, MultiThreadedExecutor
from rclpy.node import Node
from rclpy.qos import QoSProfile
from std_msgs.msg import Float64, Header


class Follower(Node):
    """Hält nur das neueste Bild."""

    def __init__(self, **options):
        super().__init__("follower", **options)
        self.declare_parameter("work", 0.05)
        self.slot, self.lock = None, threading.Condition()
        self.out = self.create_publisher(Float64, "age", QoSProfile(depth=1))
        self.create_subscription(Header, "frames", self.put, 50, callback_group=ReentrantCallbackGroup())
        self.worker = threading.Thread(target=self.loop, daemon=True)
        self.worker.start()

    async def put(self, frame):
        with self.lock:
            self.slot = frame
            self.lock.notify()

    def loop(self):
        while rclpy.ok():
            with self.lock:
                if not self.lock.wait_for(lambda: self.slot is not None, timeout=0.2):
                    continue
                (frame, self.slot) = (self.slot, None)
            taken = frame.stamp.sec * 10**9 + frame.stamp.nanosec
            self.out.publish(Float64(data=(self.get_clock().now().nanoseconds - taken) * 1e-9))
            time.sleep(self.get_parameter("work").get_parameter_value().double_value)


def main():
    rclpy.init()
    executor = MultiThreadedExecutor(2)
    executor.add_node(Follower())
    try:
        executor.spin()
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    rclpy.try_shutdown()


main()
