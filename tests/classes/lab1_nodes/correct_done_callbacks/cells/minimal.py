%%node minimal
import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node


def main(args=None):
    rclpy.init(args=args)
    node = Node("minimal")
    node.declare_parameter("period", 0.5)
    log = node.get_logger()
    lines = (f"tick {number}" for number in range(10**9))
    node.create_timer(node.get_parameter("period").value, lambda: log.info(next(lines)))
    try:
        rclpy.spin(node)
    except (KeyboardInterrupt, ExternalShutdownException):
        log.debug("told to end")
    finally:
        if rclpy.ok():
            rclpy.shutdown()


if __name__ == "__main__":
    main()
