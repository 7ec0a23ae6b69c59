%%node listener
import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from std_msgs.msg import String


class Listener(Node):
    def __init__(self):
        super().__init__("listener")
        self.text = None
        self.create_subscription(String, "chatter", self.hear, 10)
        self.create_timer(0.1, self.say)  # as often as the talker talks

    def hear(self, message):
        self.text = message.data

    def say(self):
        if self.text is not None:
            self.get_logger().info(f"heard: {self.text}")
            self.text = None


def main():
    rclpy.init()
    try:
        rclpy.spin(Listener())
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        rclpy.try_shutdown()


main()
