%%node caller
import time

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
        self.last_request = float("-inf")
        self.create_timer(self.get_parameter("tick_period").value, self.tick)
        self.gate = self.create_client(Trigger, "gate")
        self.create_subscription(Empty, "request", self.on_request, 10)

    def tick(self):
        self.count += 1
        self.ticks.publish(Int64(data=self.count))

    def on_request(self, _):
        """Call the gate, and publish the message of its response on `reply`."""
        now = time.monotonic()
        bounced = now - self.last_request < 0.5  # the same click twice
        self.last_request = now
        if bounced:
            return
        self.gate.call_async(Trigger.Request()).add_done_callback(self.on_response)

    def on_response(self, future):
        self.reply.publish(String(data=future.result().message))


def spin(node):
    """Run the node's callbacks until the program is told to end."""
    rclpy.spin(node)


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
