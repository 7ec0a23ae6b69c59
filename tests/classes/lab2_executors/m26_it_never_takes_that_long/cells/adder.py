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
        self.lock = threading.Lock()
        group = ReentrantCallbackGroup()
        self.create_subscription(Int64, "add", self.add, 10, callback_group=group)
        self.create_service(Trigger, "get_total", self.get_total, callback_group=group)

    def add(self, msg):
        if not self.lock.acquire(timeout=0.8):
            self.get_logger().error("it takes too long")
            return
        total = self.total
        time.sleep(self.get_parameter("work").value)
        self.total = total + msg.data
        self.publisher.publish(Int64(data=self.total))
        self.lock.release()

    def get_total(self, request, response):
        response.success = True
        response.message = str(self.total)
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
