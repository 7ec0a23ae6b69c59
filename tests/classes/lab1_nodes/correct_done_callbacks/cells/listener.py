%%node listener
import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from std_msgs.msg import Int64, String


class Listener(Node):
    def __init__(self):
        super().__init__("listener")
        self.last = None
        self.missing = 0
        self.lost = self.create_publisher(Int64, "lost", 10)
        self.create_subscription(String, "chatter", self.hear, 10)

    def hear(self, message):
        self.get_logger().info(f"heard: {message.data}")
        self.last, before = int(message.data.removeprefix("hello ")), self.last
        gap = 0 if before is None else self.last - before - 1
        if gap <= 0:
            return
        self.missing += gap
        self.lost.publish(Int64(data=self.missing))


def main():
    rclpy.init()
    try:
        rclpy.spin(Listener())
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        rclpy.try_shutdown()


main()
