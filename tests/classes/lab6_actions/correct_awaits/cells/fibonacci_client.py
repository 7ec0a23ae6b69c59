%%node fibonacci_client
import functools

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
    words = {value: name[7:].lower() for name, value in vars(GoalStatus).items() if name.startswith("STATUS_")}
    done = rclpy.task.Future()
    client = ActionClient(node, Fibonacci, "fibonacci")

    def show(message):
        print(f"feedback: {len(message.feedback.sequence)} numbers")

    def ended(future):
        done.set_result(words[future.result().status])

    def answered(future):
        handle = future.result()
        if not handle.accepted:
            done.set_result("rejected")
            return
        handle.get_result_async().add_done_callback(ended)
        timer = node.create_timer(patience, lambda: (timer.cancel(), handle.cancel_goal_async()))

    def begin():
        if client.server_is_ready():
            first.cancel()
            last.cancel()
            client.send_goal_async(Fibonacci.Goal(order=order), feedback_callback=show).add_done_callback(answered)

    first = node.create_timer(0.05, begin)
    last = node.create_timer(wait, functools.partial(done.set_result, "no server"))
    rclpy.spin_until_future_complete(node, done)
    print("outcome: " + done.result())
    node.destroy_node()
    rclpy.shutdown()


main()
