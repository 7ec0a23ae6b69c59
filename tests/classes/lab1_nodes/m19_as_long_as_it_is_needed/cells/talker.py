%%node talker
import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from std_msgs.msg import String


class Talker(Node):
    def __init__(self):
        super().__init__("talker")
        self.count = 0
        self.pub = self.create_publisher(String, "chatter", 10)
        self.timer = self.create_timer(0.1, self.on_timer)

    def on_timer(self):
        if self.pub.get_subscription_count() == 0:
            return  # nobody listens: do not waste the work
        msg = String()
        msg.data = "hello %d" % self.count
        self.pub.publish(msg)
        self.count += 1


def main():
    rclpy.init()
    try:
        rclpy.spin(Talker())
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        rclpy.try_shutdown()


main()
