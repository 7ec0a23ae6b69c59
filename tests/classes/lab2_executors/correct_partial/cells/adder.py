import threading
import time

import rclpy
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup
from rclpy.executors import ExternalShutdownException, MultiThreadedExecutor
from rclpy.node import Node
from std_msgs.msg import Int64
from std_srvs.srv import Trigger


class Adder(Node):
    """Locks its state twice over, and publishes after the lock."""

    def __init__(self):
        super().__init__("adder")
        self.declare_parameter("work", 0.05)
        self.adding, self.state, self._total = threading.RLock(), threading.Lock(), 0
        self.publisher = self.create_publisher(Int64, "total", 10)
        self.group = MutuallyExclusiveCallbackGroup()
        self.create_subscription(Int64, "add", self.add, 10)
        self.create_service(Trigger, "get_total", self.get_total, callback_group=self.group)

    @property
    def total(self):
        with self.state:
            return self._total

    @total.setter
    def total(self, value):
        with self.state:
            self._total = value

    def add(self, msg):
        with self.adding:
            total = self.total
            time.sleep(self.get_parameter("work").value)
            self.total = total + msg.data
        self.publisher.publish(Int64(data=total + msg.data))

    def get_total(self, request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        response.success = True
        response.message = repr(self.total)
        return response


def main():
    rclpy.init()
    executor = MultiThreadedExecutor(num_threads=4)
    executor.add_node(Adder())
    try:
        executor.spin()
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        executor.shutdown()
        rclpy.try_shutdown()


main()
