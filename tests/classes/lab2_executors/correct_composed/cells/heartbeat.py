"""Two nodes' worth of work in one node, put together from parts; the executor is a context manager."""
import time

import rclpy
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup
from rclpy.executors import ExternalShutdownException, MultiThreadedExecutor
from rclpy.node import Node
from std_msgs.msg import Int64, String


class Beat:
    def __init__(self, node):
        self.message = Int64()
        self.publisher = node.create_publisher(Int64, "heartbeat", 10)
        period = node.declare_parameter("heartbeat_period", 0.1).get_parameter_value().double_value
        self.group = MutuallyExclusiveCallbackGroup()
        self.timer = node.create_timer(timer_period_sec=period, callback=self, callback_group=self.group)

    def __call__(self):
        self.message.data += 1
        self.publisher.publish(self.message)


class Slow:
    def __init__(self, node):
        self.node = node
        self.say = node.create_publisher(String, "activity", 10).publish
        node.declare_parameter("work", 0.5)
        self.timer = node.create_timer(1.5 * self.work, self.run)

    @property
    def work(self):
        return self.node.get_parameter("work").value

    def run(self):
        self.say(String(data="slow begin"))
        time.sleep(self.work)
        self.say(String(data="slow end"))


def main():
    rclpy.init()
    with MultiThreadedExecutor(num_threads=2) as executor:
        node = Node("heartbeat")
        parts = [Slow(node), Beat(node)]
        executor.add_node(node)
        try:
            executor.spin()
        except (KeyboardInterrupt, ExternalShutdownException):
            del parts


main()
