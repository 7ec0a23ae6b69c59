%%node announcer
"""Waits for the middleware's own event that somebody was matched."""
import rclpy
from rclpy.event_handler import PublisherEventCallbacks
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from std_msgs.msg import String


class Announcer(Node):
    def __init__(self):
        super().__init__("announcer")
        self.text = self.declare_parameter("text", "ready").value
        self.done = False
        self.publisher = self.create_publisher(
            String, "announcement", 10, event_callbacks=PublisherEventCallbacks(matched=self.matched)
        )

    def matched(self, event):
        if event.current_count > 0 and not self.done:
            self.done = True
            self.publisher.publish(String(data=self.text))


def main():
    rclpy.init()
    try:
        rclpy.spin(Announcer())
    except (KeyboardInterrupt, ExternalShutdownException):
        pass


main()
