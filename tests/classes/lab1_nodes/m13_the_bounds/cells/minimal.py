import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node


class Minimal(Node):
    def __init__(self):
        super().__init__("minimal")
        self.count = 0
        self.create_timer(0.5, self.tick)

    def tick(self):
        self.get_logger().info(f"tick {self.count}")
        self.count += 1
        if self.count == 4:
            self.get_logger().info("four ticks so far")


def main():
    rclpy.init()
    try:
        rclpy.spin(Minimal())
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        rclpy.try_shutdown()


main()
