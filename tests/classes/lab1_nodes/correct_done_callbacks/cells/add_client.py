%%node add_client
import sys

import rclpy
from rclpy.node import Node
from rclpy.task import Future
from test_msgs.srv import BasicTypes


class AddClient(Node):
    def __init__(self):
        super().__init__("add_client")
        self.a = self.declare_parameter("a", 5).value
        self.b = self.declare_parameter("b", 7).value
        self.server_within = self.declare_parameter("server_within", 1.0).value  # seconds
        self.answer_within = self.declare_parameter("answer_within", 0.5).value  # seconds
        self.client = self.create_client(BasicTypes, "add_two_ints")


def ask(node):
    """Request the sum, log the outcome, and return the exit status."""
    if not node.client.wait_for_service(timeout_sec=node.server_within):
        node.get_logger().error("no server")
        return 1
    future = node.client.call_async(BasicTypes.Request(int32_value=node.a, int64_value=node.b))
    ends = Future()
    future.add_done_callback(lambda done: ends.set_result(done.result().int64_value))
    rclpy.spin_until_future_complete(node, ends, timeout_sec=node.answer_within)
    status = 0 if ends.done() else 2
    if status:
        node.get_logger().error("there is no answer")
    else:
        node.get_logger().info("The sum is here, sum: %d" % ends.result())
    return status


def main():
    rclpy.init()
    status = ask(AddClient())
    rclpy.try_shutdown()
    sys.exit(status)


main()
