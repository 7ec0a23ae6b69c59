%%node minimal
import signal

import rclpy
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions

rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
for number in (signal.SIGINT, signal.SIGTERM):
    signal.signal(number, lambda *_: rclpy.try_shutdown())
node, count = Node("minimal"), 0


def tick():
    global count
    node.get_logger().info(f"tick {count}")
    count += 1


node.create_timer(0.5, tick)
executor = SingleThreadedExecutor()
executor.add_node(node)
try:
    while rclpy.ok():
        executor.spin_once(timeout_sec=0.1)
except ExternalShutdownException:
    pass
