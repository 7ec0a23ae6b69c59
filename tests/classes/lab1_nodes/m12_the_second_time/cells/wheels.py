import rclpy
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.node import Node
from std_msgs.msg import Int64


class Wheel(Node):
    count = 0
    def __init__(self, side):
        super().__init__(f"{side}_wheel")
        self.publisher = self.create_publisher(Int64, f"{side}/ticks", 10)
        self.create_timer(0.1, self.turn)

    def turn(self):
        self.publisher.publish(Int64(data=self.count))
        Wheel.count += 1


def spin(left, right):
    """Run the callbacks of both nodes until the program is told to end."""
    executor = SingleThreadedExecutor()
    executor.add_node(left)
    executor.add_node(right)
    executor.spin()


def main():
    rclpy.init()
    left, right = Wheel("left"), Wheel("right")
    try:
        spin(left, right)
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        rclpy.try_shutdown()


main()
