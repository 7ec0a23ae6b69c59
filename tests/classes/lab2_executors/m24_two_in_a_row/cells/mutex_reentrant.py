%%node mutex_reentrant
import time

import rclpy
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup, ReentrantCallbackGroup
from rclpy.executors import ExternalShutdownException, MultiThreadedExecutor
from rclpy.node import Node
from std_msgs.msg import String


class MutexReentrant(Node):
    def __init__(self):
        super().__init__("mutex_reentrant")
        self.declare_parameter("period", 0.5)  # seconds, of all five timers
        self.declare_parameter("work", 0.15)  # seconds, of r1, r2 and r3; m1 and m2 take half as long again
        self.period = self.get_parameter("period").value
        self.work = self.get_parameter("work").value
        self.activity = self.create_publisher(String, "activity", 10)
        self.reentrant = ReentrantCallbackGroup()
        self.exclusive = MutuallyExclusiveCallbackGroup()
        self.timers_of = {}
        for callback in (self.r1, self.r2, self.r3):
            self.timers_of[callback.__name__] = self.create_timer(self.period, callback, callback_group=self.reentrant)
        for callback in (self.m1, self.m2):
            self.timers_of[callback.__name__] = self.create_timer(self.period, callback, callback_group=self.exclusive)

    def run(self, name, seconds):
        self.activity.publish(String(data=f"{name} begin"))
        time.sleep(seconds)
        self.activity.publish(String(data=f"{name} end"))
        self.timers_of[name].reset()

    def r1(self):
        self.run("r1", self.work)

    def r2(self):
        self.run("r2", self.work)

    def r3(self):
        self.run("r3", self.work)

    def m1(self):
        self.run("m1", 1.5 * self.work)

    def m2(self):
        self.run("m2", 1.5 * self.work)


def spin(node):
    """Run the node's callbacks until the program is told to end."""
    executor = MultiThreadedExecutor(num_threads=5)
    executor.add_node(node)
    executor.spin()


def main():
    rclpy.init()
    node = MutexReentrant()
    try:
        spin(node)
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        rclpy.try_shutdown()


main()
