%%node two_mutex
import time

import rclpy
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup, ReentrantCallbackGroup
from rclpy.executors import ExternalShutdownException, MultiThreadedExecutor
from rclpy.node import Node
from std_msgs.msg import String


class TwoMutex(Node):
    def __init__(self):
        super().__init__("two_mutex")
        self.declare_parameter("period", 0.4)  # seconds, of all four timers
        self.declare_parameter("work", 0.12)  # seconds, of a1 and b1; a2 and b2 take half as long again
        self.period = self.get_parameter("period").value
        self.work = self.get_parameter("work").value
        self.activity = self.create_publisher(String, "activity", 10)
        self.joint_a = MutuallyExclusiveCallbackGroup()
        self.joint_b = MutuallyExclusiveCallbackGroup()
        self.clockwork = {
            "a1": self.create_timer(self.period, self.a1, callback_group=self.joint_a),
            "a2": self.create_timer(self.period, self.a2, callback_group=self.joint_a),
            "b1": self.create_timer(self.period, self.b1, callback_group=self.joint_b),
            "b2": self.create_timer(self.period, self.b2, callback_group=self.joint_b),
        }

    def run(self, name, seconds):
        self.activity.publish(String(data=f"{name} begin"))
        time.sleep(seconds)
        self.activity.publish(String(data=f"{name} end"))
        self.clockwork[name].reset()

    def a1(self):
        self.run("a1", self.work)

    def a2(self):
        self.run("a2", 1.5 * self.work)

    def b1(self):
        self.run("b1", self.work)

    def b2(self):
        self.run("b2", 1.5 * self.work)


def spin(node):
    """Run the node's callbacks until the program is told to end."""
    executor = MultiThreadedExecutor(num_threads=2)
    executor.add_node(node)
    executor.spin()


def main():
    rclpy.init()
    node = TwoMutex()
    try:
        spin(node)
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        rclpy.try_shutdown()


main()
