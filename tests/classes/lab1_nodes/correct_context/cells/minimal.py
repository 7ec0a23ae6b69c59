%%node minimal
import rclpy
from rclpy.executors import ExternalShutdownException, MultiThreadedExecutor
from rclpy.node import Node


class Minimal(Node):
    __slots__ = ("count",)

    def __init__(self, **options):
        super().__init__("minimal", **options)
        self.count = -1
        self.create_timer(timer_period_sec=0.5, callback=self.tick)

    def tick(self):
        self.count += 1
        self.get_logger().log(f"tick {self.count}", rclpy.logging.LoggingSeverity.INFO)


if __name__ == "__main__":
    rclpy.init()
    context = rclpy.get_default_context()
    try:
        with MultiThreadedExecutor(num_threads=2, context=context) as executor:
            executor.add_node(Minimal(context=context))
            executor.spin()
    except (KeyboardInterrupt, ExternalShutdownException):
        context.try_shutdown()
