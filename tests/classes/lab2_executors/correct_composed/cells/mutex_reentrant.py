import threading
import time

import rclpy
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.executors import ExternalShutdownException, MultiThreadedExecutor
from rclpy.node import Node
from std_msgs.msg import String


class MutexReentrant(Node):
    """All five in one reentrant group; a lock keeps m1 and m2 apart."""

    def __init__(self):
        group = ReentrantCallbackGroup()
        super().__init__("mutex_reentrant")
        self.declare_parameter("period", 0.5)
        self.declare_parameter("work", 0.15)
        self.activity = self.create_publisher(String, "activity", 10)
        self.motor = threading.Lock()
        for name in ("r1", "r2", "r3"):
            self.create_timer(self.get_parameter("period").value, lambda name=name: self.run(name, 1.0), group)
        for name in ("m1", "m2"):
            self.create_timer(self.get_parameter("period").value, lambda name=name: self.alone(name), group)

    def alone(self, name):
        with self.motor:
            self.run(name, 1.5)

    def run(self, name, share):
        self.activity.publish(String(data=f"{name} begin"))
        time.sleep(share * self.get_parameter("work").value)
        self.activity.publish(String(data=f"{name} end"))


def main():
    rclpy.init()
    executor = MultiThreadedExecutor(num_threads=10)
    executor.add_node(MutexReentrant())
    try:
        executor.spin()
    except (KeyboardInterrupt, ExternalShutdownException):
        pass


main()
