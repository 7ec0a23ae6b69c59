import functools
import itertools
import time

import rclpy
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup
from rclpy.executors import ExternalShutdownException, MultiThreadedExecutor
from rclpy.node import Node
from std_msgs.msg import String


class LongTimer(Node):
    """Guards the number of runs itself: more threads than runs, and what finds no place is dropped."""

    def __init__(self):
        super().__init__("long_timer")
        self.declare_parameter("period", 0.2)
        self.declare_parameter("work", 1.0)
        self.numbers = itertools.count(1)
        self.activity = self.create_publisher(String, "activity", 10)
        self.places = [MutuallyExclusiveCallbackGroup() for _ in range(4)]
        self.taken = {}
        self.create_timer(self.get_parameter("period").value, self.give)

    def give(self):
        for place in self.places:
            if place not in self.taken:
                guard = self.create_guard_condition(functools.partial(self.tick, place), callback_group=place)
                self.taken[place] = guard
                guard.trigger()
                return

    def tick(self, place):
        number = next(self.numbers)
        self.activity.publish(String(data=f"tick {number} begin"))
        time.sleep(self.get_parameter("work").value)
        self.activity.publish(String(data=f"tick {number} end"))
        del self.taken[place]


def main():
    rclpy.init()
    executor = MultiThreadedExecutor(num_threads=6)
    executor.add_node(LongTimer())
    try:
        executor.spin()
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        rclpy.try_shutdown()


main()
