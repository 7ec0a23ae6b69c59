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
    client = ActionClient(node, Fibonacci, "fibonacci")
    if not client.wait_for_server(timeout_sec=wait):
        print("outcome: no server")
        rclpy.shutdown()
        return
    future = client.send_goal_async(
        Fibonacci.Goal(order=order), feedback_callback=lambda message: print("feedback", message.feedback.sequence))
    rclpy.spin_until_future_complete(node, future)
    handle = future.result()
    if not handle.accepted:
        print("outcome: rejected")
        rclpy.shutdown()
        return
    result = handle.get_result_async()
    rclpy.spin_until_future_complete(node, result, timeout_sec=wait)
    if not result.done():
        rclpy.spin_until_future_complete(node, handle.cancel_goal_async())
        rclpy.spin_until_future_complete(node, result)
    words = {GoalStatus.STATUS_SUCCEEDED: "succeeded", GoalStatus.STATUS_CANCELED: "canceled", GoalStatus.STATUS_ABORTED: "aborted"}
    print("outcome:", words[result.result().status])
    rclpy.shutdown()


main()
