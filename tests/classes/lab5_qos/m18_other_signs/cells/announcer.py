import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from std_msgs.msg import String


class Announcer(Node):
    def __init__(self):
        super().__init__("announcer")
        self.declare_parameter("text", "ready")
        self.publisher = self.create_publisher(String, "announcement", 10)
        self.text = self.get_parameter("text").value
        self.timer = self.create_timer(0.1, self.look)

    def look(self):
        if self.count_subscribers("announcement"):
            self.publisher.publish(String(data=self.text.strip()))
            self.timer.cancel()


def main():
    rclpy.init()
    try:
        rclpy.spin(Announcer())
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    rclpy.try_shutdown()


main()
