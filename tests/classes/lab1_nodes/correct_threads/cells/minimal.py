%%node minimal
import threading

import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node


class Minimal(Node):
    def __init__(self):
        super().__init__("minimal")
        self.count = 0
        self.lock = threading.Lock()
        self.create_timer(0.5, self.tick)

    def tick(self):
        with self.lock:
            self.get_logger().info(f"tick {self.count}")
            self.count += 1


def main():
    rclpy.init()
    try:
        rclpy.spin(Minimal())
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    except Exception as error:
        raise SystemExit(error)
    rclpy.try_shutdown()


main()
