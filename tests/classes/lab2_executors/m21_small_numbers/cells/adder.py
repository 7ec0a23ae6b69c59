import threading

import rclpy
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup
from rclpy.executors import ExternalShutdownException, MultiThreadedExecutor
from rclpy.node import Node
from std_msgs.msg import Int64
from std_srvs.srv import Trigger


class Adder(Node):
    def __init__(self):
        super().__init__("adder")
        self.declare_parameter("work", 0.05)  # seconds
        self.total = 0
        self.worked = threading.Event()  # nobody sets it
        self.publisher = self.create_publisher(Int64, "total", 10)
        self.work = self.get_parameter("work").value
        self.adding = MutuallyExclusiveCallbackGroup()
        self.create_subscription(Int64, "add", self.add, 10, callback_group=self.adding)
        self.create_service(Trigger, "get_total", self.get_total)

    def add(self, msg):
        total = self.total
        if msg.data:
            self.worked.wait(self.work)
        self.total = total + msg.data
        self.publisher.publish(Int64(data=self.total))

    def get_total(self, request, response):
        response.success = True
        response.message = f"{self.total:,}"
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
