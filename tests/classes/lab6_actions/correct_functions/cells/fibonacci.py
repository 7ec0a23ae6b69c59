%%node fibonacci
import functools
import threading

import rclpy
from rclpy.action import ActionServer, CancelResponse, GoalResponse
from rclpy.executors import ExternalShutdownException, MultiThreadedExecutor
from std_msgs.msg import Int64
from test_msgs.action import Fibonacci


def decide(goal):
    if goal.order < 1:
        return GoalResponse.REJECT
    if goal.order > 46:
        return GoalResponse.REJECT
    return GoalResponse.ACCEPT


def numbers():
    a, b = 0, 1
    while True:
        yield a
        a, b = b, a + b


def execute(pause, handle):
    source, result = numbers(), Fibonacci.Result()
    result.sequence = [next(source), next(source)]
    for _ in range(handle.request.order - 1):
        threading.Event().wait(pause)
        if handle.is_cancel_requested:
            break
        result.sequence.append(next(source))
        feedback = Fibonacci.Feedback()
        feedback.sequence = result.sequence
        handle.publish_feedback(feedback)
    handle.canceled() if handle.is_cancel_requested else handle.succeed()
    return result


def main():
    rclpy.init()
    node = rclpy.create_node("fibonacci")
    pause = node.declare_parameter("step", 0.5).value
    publisher = node.create_publisher(Int64, "ticks", 10)
    ticks = iter(range(1, 10**9))
    node.create_timer(0.1, lambda: publisher.publish(Int64(data=next(ticks))))
    server = ActionServer(
        node,
        Fibonacci,
        "fibonacci",
        functools.partial(execute, pause),
        goal_callback=decide,
        cancel_callback=lambda _: CancelResponse.ACCEPT,
    )
    executor = MultiThreadedExecutor(num_threads=3)
    executor.add_node(node)
    try:
        executor.spin()
    except (KeyboardInterrupt, ExternalShutdownException):
        server.destroy()
    finally:
        rclpy.try_shutdown()


if __name__ == "__main__":
    main()
