%%node long_timer
import itertools
import time

import rclpy
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup, ReentrantCallbackGroup
from rclpy.executors import ExternalShutdownException, MultiThreadedExecutor
from rclpy.node import Node
from std_msgs.msg import String


class LongTimer(Node):
    def __init__(self):
        super().__init__("long_timer")
        self.declare_parameter("period", 0.2)  # seconds
        self.declare_parameter("work", 1.0)  # seconds: longer than the period
        self.numbers = itertools.count(1)  # the runs are numbered, so that they can be told apart
        self.activity = self.create_publisher(String, "activity", 10)
        self.group = ReentrantCallbackGroup()
        # With four runs at once, a run can begin only every quarter of the work.
        period = max(self.get_parameter("period").value, self.get_parameter("work").value / 4)
        self.create_timer(period, self.tick, callback_group=self.group)

    def tick(self):
        number = next(self.numbers)
        self.activity.publish(String(data=f"tick {number} begin"))
        time.sleep(self.get_parameter("work").value)
        self.activity.publish(String(data=f"tick {number} end"))


def spin(node):
    """Run the node's callbacks until the program is told to end."""
    executor = MultiThreadedExecutor(num_threads=4)
    executor.add_node(node)
    executor.spin()


def main():
    rclpy.init()
    node = LongTimer()
    try:
        spin(node)
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        rclpy.try_shutdown()


main()
