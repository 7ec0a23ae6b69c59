%%node stopper
import rclpy
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.node import Node
from rclpy.task import Future
from std_msgs.msg import Empty, Int64


class Stopper(Node):
    def __init__(self):
        super().__init__("stopper")
        self.declare_parameter("tick_period", 0.1)  # seconds
        self.count = 0
        self.ticks = self.create_publisher(Int64, "ticks", 10)
        self.create_timer(self.get_parameter("tick_period").value, self.tick)
        self.create_subscription(Empty, "stop", self.on_stop, 10)
        self.stopped = Future()

    def tick(self):
        self.count += 1
        self.ticks.publish(Int64(data=self.count))

    def on_stop(self, _):
        """End the program."""
        self.stopped.set_result(True)


def spin(node):
    """Run the node's callbacks until the program is told to end."""
    rclpy.spin_until_future_complete(node, node.stopped, timeout_sec=100 * node.get_parameter("tick_period").value)


def main():
    rclpy.init()
    node = Stopper()
    try:
        spin(node)
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        rclpy.try_shutdown()
        print("ended")


main()
