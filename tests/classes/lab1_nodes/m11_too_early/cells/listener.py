%%node listener
import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from std_msgs.msg import Int64, String


class Listener(Node):
    def __init__(self):
        super().__init__("listener")
        self.last = None
        self.lost = 0
        self.pub = self.create_publisher(Int64, "lost", 10)
        self.create_subscription(String, "chatter", self.callback, 10)

    def callback(self, msg):
        self.get_logger().info(f"heard: {msg.data}")
        n = int(msg.data.split()[1])
        if self.last is None:
            self.last = n
        elif n <= self.last:
            self.last = None
        else:
            if n > self.last + 1:
                self.lost += n - self.last - 1
                self.pub.publish(Int64(data=self.lost))
            self.last = n


def main():
    rclpy.init()
    try:
        rclpy.spin(Listener())
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        rclpy.try_shutdown()


main()
