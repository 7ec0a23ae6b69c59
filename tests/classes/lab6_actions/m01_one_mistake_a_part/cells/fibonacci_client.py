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
        return

    def ended(future):
        status = future.result().status
        print("outcome:", {4: "succeeded", 5: "canceled", 6: "aborted"}[status])
        rclpy.shutdown()

    def answered(future):
        handle = future.result()
        if not handle.accepted:
            print("outcome: rejected")
            return
        node.create_timer(patience, handle.cancel_goal_async)
        handle.get_result_async().add_done_callback(ended)

    goal = Fibonacci.Goal(order=order)
    future = client.send_goal_async(goal, feedback_callback=lambda m: print("feedback", list(m.feedback.sequence)))
    future.add_done_callback(answered)
    rclpy.spin(node)
    rclpy.try_shutdown()


main()
