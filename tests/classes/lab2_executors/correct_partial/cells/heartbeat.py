"""Two nodes in one process: a node's default group is its own, so their callbacks overlap."""
import functools
import time

import rclpy
from rclpy.executors import ExternalShutdownException, MultiThreadedExecutor
from rclpy.node import Node
from std_msgs.msg import Int64, String


def beat(state, publisher):
    state["count"] += 1
    publisher.publish(Int64(data=state["count"]))


def slow(publisher, work):
    for word in ("begin", "end"):
        publisher.publish(String(data=f"slow {word}"))
        if word == "begin":
            time.sleep(work)


def main():
    rclpy.init()
    heart, worker = Node("heartbeat"), Node("worker")
    for node in (heart, worker):
        node.declare_parameter("heartbeat_period", 0.1)
        node.declare_parameter("work", 0.5)
    work = worker.get_parameter("work").value
    publisher = heart.create_publisher(Int64, "heartbeat", 10)
    heart.create_timer(heart.get_parameter("heartbeat_period").value, functools.partial(beat, {"count": 0}, publisher))
    activity = worker.create_publisher(String, "activity", 10)
    worker.create_timer(1.5 * work, functools.partial(slow, activity, work))
    executor = MultiThreadedExecutor(num_threads=2)
    executor.add_node(heart)
    executor.add_node(worker)
    try:
        executor.spin()
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        rclpy.try_shutdown()


main()
