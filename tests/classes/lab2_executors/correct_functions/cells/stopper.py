import sys

import rclpy
from rclpy.executors import ExternalShutdownException
from std_msgs.msg import Empty, Int64


def main():
    """Leaves `main` by sys.exit in the callback: under one thread it comes through `spin`."""
    rclpy.init()
    node = rclpy.create_node("stopper")
    ticks = node.create_publisher(Int64, "ticks", 10)
    node.declare_parameter("tick_period", 0.1)
    count = iter(range(1, 10**9))
    node.create_timer(node.get_parameter("tick_period").value, lambda: ticks.publish(Int64(data=next(count))))
    node.create_subscription(Empty, "stop", lambda _: sys.exit(), 1)
    try:
        rclpy.spin(node)
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        node.destroy_node()
        rclpy.try_shutdown()
        print("ended")


main()
