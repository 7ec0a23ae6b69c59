%%node add_client
import sys
from threading import Thread

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
    Thread(target=rclpy.spin, args=(node,), daemon=True).start()
    request = BasicTypes.Request()
    request.int32_value, request.int64_value = node.a, node.b
    response = node.client.call(request, timeout_sec=node.answer_within)
    if response is None:
        node.get_logger().error("no answer")
        return 2
    node.get_logger().info(f"sum: {response.int64_value}")
    return 0


def main():
    rclpy.init()
    status = ask(AddClient())
    rclpy.try_shutdown()
    import time

    time.sleep(0.2)  # the thread that spins ends first
    sys.exit(status)


main()
