%%node announcer
import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from std_msgs.msg import String


class Announcer(Node):
    def __init__(self):
        super().__init__("announcer")
        self.declare_parameter("text", "ready")
        self.publisher = self.create_publisher(String, "announcement", 10)
        self.looks = 0
        self.timer = self.create_timer(0.1, self.announce)

    def announce(self):
        self.looks += 1
        if self.publisher.get_subscription_count() > 0:
            self.publisher.publish(String(data=self.get_parameter("text").value))
            self.timer.cancel()
        elif self.looks == 60:
            self.timer.cancel()  # nobody is there


def main():
    rclpy.init()
    try:
        rclpy.spin(Announcer())
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    rclpy.try_shutdown()


main()
