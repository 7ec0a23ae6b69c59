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
        number = int(message.data.split()[-1])
        if self.last is not None and number <= self.last:
            self.missing = 0
        if self.last is not None and number > self.last + 1:
            self.missing += number - self.last - 1
            self.lost.publish(Int64(data=self.missing))
        self.last = number


def main():
    rclpy.init()
    try:
        rclpy.spin(Listener())
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        rclpy.try_shutdown()


main()
