import time

import rclpy
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup
from rclpy.executors import ExternalShutdownException, MultiThreadedExecutor
from std_msgs.msg import String


def main():
    rclpy.init()
    node = rclpy.create_node("mutex_reentrant")
    period = node.declare_parameter("period", 0.5).value
    work = node.declare_parameter("work", 0.15).value
    activity = node.create_publisher(String, "activity", 10)

    def add(name, seconds, group):
        def run():
            activity.publish(String(data=f"{name} begin"))
            time.sleep(seconds)
            activity.publish(String(data=f"{name} end"))

        node.create_timer(period, run, callback_group=group)

    # A group of its own for each of r1, r2, r3: they overlap each other, but not themselves. One thread too few for all.
    for name in ("r1", "r2", "r3"):
        add(name, work, MutuallyExclusiveCallbackGroup())
    for name in ("m1", "m2"):
        add(name, 1.5 * work, node.default_callback_group)
    executor = MultiThreadedExecutor(num_threads=4)
    executor.add_node(node)
    try:
        executor.spin()
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        rclpy.try_shutdown()


if __name__ == "__main__":
    main()
