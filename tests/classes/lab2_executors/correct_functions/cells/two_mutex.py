import threading
import time

import rclpy
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from std_msgs.msg import String


def main():
    # The joint b is done by a thread of its own; one publisher for both keeps the order of what is published.
    rclpy.init()
    node = rclpy.create_node("two_mutex")
    node.declare_parameter("period", 0.4)
    node.declare_parameter("work", 0.12)
    period, work = node.get_parameter("period").value, node.get_parameter("work").value
    activity = node.create_publisher(String, "activity", 10)

    def run(name, seconds):
        activity.publish(String(data=f"{name} begin"))
        time.sleep(seconds)
        activity.publish(String(data=f"{name} end"))

    wake = threading.Semaphore(0)

    def other_joint():
        while wake.acquire():
            run("b1", work)
            run("b2", 1.5 * work)

    threading.Thread(target=other_joint, daemon=True).start()
    node.create_timer(period, lambda: run("a1", work))
    node.create_timer(period, lambda: run("a2", 1.5 * work))
    helper = rclpy.create_node("helper")
    helper.create_timer(period, wake.release)
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    second = SingleThreadedExecutor()
    second.add_node(helper)
    threading.Thread(target=second.spin, daemon=True).start()
    try:
        executor.spin()
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        rclpy.try_shutdown()


main()
