%%node fibonacci_client
import time

import rclpy
from action_msgs.msg import GoalStatus
from rclpy.action import ActionClient
from test_msgs.action import Fibonacci

WORDS = {
    GoalStatus.STATUS_SUCCEEDED: "succeeded",
    GoalStatus.STATUS_CANCELED: "canceled",
    GoalStatus.STATUS_ABORTED: "aborted",
}


asked = []


def show(message):
    if not asked:
        print("feedback", list(message.feedback.sequence), flush=True)


def run(node, order, wait, patience):
    begin = time.monotonic()
    client = ActionClient(node, Fibonacci, "fibonacci")
    if not client.wait_for_server(timeout_sec=wait or None):
        return "no server"
    sent = client.send_goal_async(Fibonacci.Goal(order=order), feedback_callback=show)
    rclpy.spin_until_future_complete(node, sent)
    handle = sent.result()
    if not handle.accepted:
        return "rejected"
    ended = handle.get_result_async()
    rclpy.spin_until_future_complete(node, ended, timeout_sec=max(0.0, begin + patience - time.monotonic()))
    if not ended.done():
        handle.cancel_goal_async()
        asked.append(True)
        rclpy.spin_until_future_complete(node, ended)
    return WORDS[ended.result().status]


def main():
    rclpy.init()
    node = rclpy.create_node("fibonacci_client")
    order = node.declare_parameter("order", 6).value
    wait = node.declare_parameter("wait", 2.0).value  # seconds for the server to appear
    patience = node.declare_parameter("patience", 5.0).value  # seconds until it asks to cancel
    print("outcome:", run(node, order, wait, patience), flush=True)
    rclpy.try_shutdown()


main()
