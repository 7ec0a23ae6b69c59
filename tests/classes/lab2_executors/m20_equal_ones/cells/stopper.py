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
        self.done = Future()
        self.last = None

    def tick(self):
        self.count += 1
        self.ticks.publish(Int64(data=self.count))

    def on_stop(self, _):
        """End the program."""
        if self.last is None:  # give the last messages the time to leave
            self.last = self.create_timer(2.0, lambda: self.done.done() or self.done.set_result(True))


def spin(node):
    """Run the node's callbacks until the program is told to end."""
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    executor.spin_until_future_complete(node.done)


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
