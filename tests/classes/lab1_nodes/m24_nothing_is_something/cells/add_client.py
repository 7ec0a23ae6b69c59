%%node add_client
import sys

import rclpy
from rclpy.node import Node
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

    future = node.client.call_async(BasicTypes.Request(int32_value=node.a or 5, int64_value=node.b or 7))
    rclpy.spin_until_future_complete(node, future, timeout_sec=node.answer_within)
    if not future.done():
        node.get_logger().error("no answer")
        return 2
    node.get_logger().info(f"sum: {future.result().int64_value}")
    return 0


def main():
    rclpy.init()
    status = ask(AddClient())
    rclpy.try_shutdown()
    sys.exit(status)


main()
