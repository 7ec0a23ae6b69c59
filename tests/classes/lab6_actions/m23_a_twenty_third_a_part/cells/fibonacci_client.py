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
    outcome = "no server"
    told = []
    if client.wait_for_server(timeout_sec=wait):
        sent = client.send_goal_async(
            Fibonacci.Goal(order=order),
            feedback_callback=lambda message: told.append(message.feedback.sequence),
        )
        rclpy.spin_until_future_complete(node, sent)
        handle = sent.result()
        if not handle.accepted:
            outcome = "rejected"
        else:
            ended = handle.get_result_async()
            rclpy.spin_until_future_complete(node, ended, timeout_sec=patience)
            if not ended.done():
                handle.cancel_goal_async()
                rclpy.spin_until_future_complete(node, ended)
            status = ended.result().status
            if status == GoalStatus.STATUS_SUCCEEDED:
                outcome = "succeeded"
            elif status == GoalStatus.STATUS_ABORTED:
                outcome = "aborted"
            elif status == GoalStatus.STATUS_CANCELED:
                outcome = "canceled"
    if told:
        print("feedback", list(told[-1]))
    print("outcome:", outcome)
    rclpy.shutdown()


main()
