%%node fibonacci_client
import threading
import time

import rclpy
from rclpy.executors import SingleThreadedExecutor
from action_msgs.msg import GoalStatus
from rclpy.action import ActionClient
from test_msgs.action import Fibonacci


def main():
    rclpy.init()
    node = rclpy.create_node("fibonacci_client")
    order = node.declare_parameter("order", 6).value
    wait = node.declare_parameter("wait", 2.0).value  # seconds for the server to appear
    patience = node.declare_parameter("patience", 5.0).value  # seconds until it asks to cancel
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    thread = threading.Thread(target=executor.spin)
    thread.start()
    try:
        word = run(ActionClient(node, Fibonacci, "fibonacci"), order, wait, patience)
    finally:
        executor.shutdown()
        rclpy.try_shutdown()
        thread.join()
    print("outcome:", word)


def wait_for(future, seconds=1e9):
    until = time.monotonic() + seconds
    while not future.done() and time.monotonic() < until:
        time.sleep(0.01)
    return future.done()


def run(client, order, wait, patience):
    if not client.wait_for_server(wait):
        return "no server"
    goal = Fibonacci.Goal()
    goal.order = order
    asked = client.send_goal_async(goal, lambda told: print("feedback", *told.feedback.sequence, flush=True))
    wait_for(asked)
    handle = asked.result()
    if not handle.accepted:
        return "rejected"
    ended = handle.get_result_async()
    if not wait_for(ended, patience):
        wait_for(handle.cancel_goal_async())
        wait_for(ended)
    status = ended.result().status
    if status == GoalStatus.STATUS_SUCCEEDED:
        return "succeeded"
    return "canceled" if status == GoalStatus.STATUS_CANCELED else "aborted"


main()
