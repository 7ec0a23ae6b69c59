import functools
import time

import rclpy
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup, ReentrantCallbackGroup
from rclpy.executors import ExternalShutdownException, MultiThreadedExecutor
from rclpy.node import Node
from std_msgs.msg import String


class MutexReentrant(Node):
    def __init__(self, **arguments):
        super().__init__("mutex_reentrant", **arguments)
        self.declare_parameters("", [("period", 0.5), ("work", 0.15)])
        self.activity = self.create_publisher(String, "activity", 10)
        shared = ReentrantCallbackGroup(), MutuallyExclusiveCallbackGroup()
        self.kept = [
            self.create_timer(
                self.get_parameter("period").get_parameter_value().double_value,
                functools.partial(self.run, name, part),
                callback_group=shared[name.startswith("m")],
            )
            for name, part in [("m1", 1.5), ("m2", 1.5), ("r1", 1), ("r2", 1), ("r3", 1)]
        ]

    def run(self, name, part):
        self.activity.publish(String(data=name + " begin"))
        time.sleep(self.get_parameter("work").value * part)
        self.activity.publish(String(data=name + " end"))


def main():
    rclpy.init()
    executor = MultiThreadedExecutor(5)
    executor.add_node(MutexReentrant())
    try:
        while rclpy.ok():
            executor.spin_once(timeout_sec=0.5)
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        rclpy.try_shutdown()


main()
