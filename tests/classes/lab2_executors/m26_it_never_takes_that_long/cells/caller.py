%%node caller
import threading

import rclpy
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup, ReentrantCallbackGroup
from rclpy.executors import ExternalShutdownException, MultiThreadedExecutor
from rclpy.node import Node
from std_msgs.msg import Empty, Int64, String
from std_srvs.srv import Trigger


class Caller(Node):
    def __init__(self):
        super().__init__("caller")
        self.declare_parameter("tick_period", 0.1)  # seconds
        self.count = 0
        self.ticks = self.create_publisher(Int64, "ticks", 10)
        self.reply = self.create_publisher(String, "reply", 10)
        self.create_timer(self.get_parameter("tick_period").value, self.tick)
        self.group = MutuallyExclusiveCallbackGroup()
        self.create_subscription(Empty, "request", self.on_request, 10, callback_group=self.group)
        self.gate = self.create_client(Trigger, "gate")

    def tick(self):
        self.count += 1
        self.ticks.publish(Int64(data=self.count))

    def on_request(self, _):
        """Call the gate, and publish the message of its response on `reply`."""
        answered = threading.Event()
        future = self.gate.call_async(Trigger.Request())
        future.add_done_callback(lambda _: answered.set())
        if answered.wait(2.0):
            self.reply.publish(String(data=future.result().message))


def spin(node):
    """Run the node's callbacks until the program is told to end."""
    executor = MultiThreadedExecutor(num_threads=2)
    executor.add_node(node)
    executor.spin()


def main():
    rclpy.init()
    node = Caller()
    try:
        spin(node)
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        rclpy.try_shutdown()


main()
