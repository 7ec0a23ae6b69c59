%%node speed_keeper
import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from std_msgs.msg import Float64, Int32


class SpeedKeeper(Node):
    """Each topic has a timer that says that it is not fresh any more; a message sets the timer back."""

    def __init__(self):
        super().__init__("speed_keeper")
        patience = self.declare_parameter("patience", 0.5).value
        self.fresh, self.alarm = set(), {}
        for topic in ("obstacles", "scan"):
            self.alarm[topic] = self.create_timer(patience, lambda topic=topic: self.fresh.discard(topic))
            self.create_subscription(Int32, topic, lambda _, topic=topic: self.hear(topic), 1)
        self.publisher = self.create_publisher(Float64, "speed", 10)
        self.create_timer(0.1, self.tell)

    def hear(self, topic):
        self.fresh.add(topic)
        self.alarm[topic].reset()

    def tell(self):
        table = [("obstacles", 2.0), ("scan", 0.5)]
        self.publisher.publish(Float64(data=next((speed for topic, speed in table if topic in self.fresh), 0.0)))


def main():
    rclpy.init()
    try:
        rclpy.spin(SpeedKeeper())
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    rclpy.try_shutdown()


main()
