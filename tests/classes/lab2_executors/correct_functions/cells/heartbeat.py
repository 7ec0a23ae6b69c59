"""No class at all: a node made by a function, callbacks as closures, a thread for the slow work."""
import itertools
import time

import rclpy
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.executors import ExternalShutdownException, MultiThreadedExecutor
from std_msgs.msg import Int64, String

rclpy.init()
node = rclpy.create_node("heartbeat")
node.declare_parameters("", [("heartbeat_period", 0.1), ("work", 0.5)])
period, work = (node.get_parameter(name).value for name in ("heartbeat_period", "work"))
numbers = itertools.count(1)
heartbeat = node.create_publisher(Int64, "heartbeat", 10)
activity = node.create_publisher(String, "activity", 10)


def slow():
    activity.publish(String(data="slow begin"))
    time.sleep(work)
    activity.publish(String(data="slow end"))


# Both in one reentrant group: slow's period is longer than its work, so it does not overlap itself.
group = ReentrantCallbackGroup()
timers = [
    node.create_timer(1.5 * work, slow, group),
    node.create_timer(period, lambda: heartbeat.publish(Int64(data=next(numbers))), group),
]
executor = MultiThreadedExecutor(3)
executor.add_node(node)
try:
    executor.spin()
except (KeyboardInterrupt, ExternalShutdownException):
    pass
