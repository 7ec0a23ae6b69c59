%%node heartbeat
import time

import rclpy
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup, ReentrantCallbackGroup
from rclpy.executors import ExternalShutdownException, MultiThreadedExecutor
from rclpy.node import Node
from std_msgs.msg import Int64, String


class Heartbeat(Node):
    def __init__(self):
        super().__init__("heartbeat")
        self.declare_parameter("heartbeat_period", 0.1)  # seconds
        self.declare_parameter("work", 0.5)  # seconds
        self.work = self.get_parameter("work").value
        self.count = 0
        self.heartbeat = self.create_publisher(Int64, "heartbeat", 10)
        self.activity = self.create_publisher(String, "activity", 10)
        period = self.get_parameter("heartbeat_period").value
        self.slow_group = MutuallyExclusiveCallbackGroup()
        self.create_timer(period, self.beat)
        self.create_timer(0.5, self.slow, callback_group=self.slow_group)

    def beat(self):
        self.count += 1
        self.heartbeat.publish(Int64(data=self.count))

    def slow(self):
        self.activity.publish(String(data="slow begin"))
        time.sleep(self.work)
        self.activity.publish(String(data="slow end"))


def spin(node):
    """Run the node's callbacks until the program is told to end."""
    executor = MultiThreadedExecutor(num_threads=2)
    executor.add_node(node)
    executor.spin()


def main():
    rclpy.init()
    node = Heartbeat()
    try:
        spin(node)
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        rclpy.try_shutdown()


main()
