%%node adder
import threading
import time

import rclpy
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup, ReentrantCallbackGroup
from rclpy.executors import ExternalShutdownException, MultiThreadedExecutor
from rclpy.node import Node
from std_msgs.msg import Int64
from std_srvs.srv import Trigger


class Adder(Node):
    def __init__(self):
        super().__init__("adder")
        self.declare_parameter("work", 0.05)  # seconds
        self.total = 0
        self.publisher = self.create_publisher(Int64, "total", 10)
        self.pending = set()
        self.working = MutuallyExclusiveCallbackGroup()
        self.create_subscription(Int64, "add", self.receive, 10)
        self.create_service(Trigger, "get_total", self.get_total)
        self.create_timer(0.005, self.add_next, callback_group=self.working)

    def receive(self, msg):
        self.pending.add(msg.data)

    def add_next(self):
        if not self.pending:
            return
        total, number = self.total, self.pending.pop()
        time.sleep(self.get_parameter("work").value)
        self.total = total + number
        self.publisher.publish(Int64(data=self.total))

    def get_total(self, request, response):
        response.success, response.message = True, str(self.total)
        return response


def spin(node):
    """Run the node's callbacks until the program is told to end."""
    executor = MultiThreadedExecutor(num_threads=4)
    executor.add_node(node)
    executor.spin()


def main():
    rclpy.init()
    node = Adder()
    try:
        spin(node)
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        rclpy.try_shutdown()


main()
