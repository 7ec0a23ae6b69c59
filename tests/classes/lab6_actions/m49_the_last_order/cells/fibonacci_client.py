%%node fibonacci_client
import rclpy
from action_msgs.msg import GoalStatus
from rclpy.action import ActionClient
from test_msgs.action import Fibonacci


def main():
    rclpy.init()
    node = rclpy.create_node("fibonacci_client")
    order = node.declare_parameter("order", 6).value
    wait = node.declare_parameter("wait", 2.0).value  # seconds for the server to appear
    patience = node.declare_parameter("patience", 5.0).value  # seconds until it asks to cancel
    print("outcome:", outcome(node, order, wait, patience))
    rclpy.try_shutdown()


def outcome(node, order, wait, patience):
    client = ActionClient(node, Fibonacci, "fibonacci")
    if not client.wait_for_server(timeout_sec=wait):
        return "no server"
    answered = client.send_goal_async(Fibonacci.Goal(order=order), feedback_callback=heard)
    rclpy.spin_until_future_complete(node, answered)
    goal_handle = answered.result()
    if not goal_handle.accepted:
        return "rejected"
    ended = goal_handle.get_result_async()
    rclpy.spin_until_future_complete(node, ended, timeout_sec=patience or None)
    if not ended.done():
        goal_handle.cancel_goal_async()
        rclpy.spin_until_future_complete(node, ended)
    words = {
        GoalStatus.STATUS_SUCCEEDED: "succeeded",
        GoalStatus.STATUS_CANCELED: "canceled",
        GoalStatus.STATUS_ABORTED: "aborted",
    }
    return words[ended.result().status]


def heard(message):
    print("feedback", list(message.feedback.sequence))


main()
