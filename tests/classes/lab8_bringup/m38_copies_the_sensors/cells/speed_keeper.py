%%node speed_keeper
import time

import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from std_msgs.msg import Float64, Int32


class SpeedKeeper(Node):
    def __init__(self):
        super().__init__("speed_keeper")
        self.declare_parameter("patience", 0.5)
        self.last = {"obstacles": float("-inf"), "scan": float("-inf")}
        for topic in self.last:
            self.create_subscription(Int32, topic, lambda _, topic=topic: self.hear(topic), 10)
        self.publisher = self.create_publisher(Float64, "speed", 10)
        self.create_timer(0.1, self.tell)

    def hear(self, topic):
        self.last[topic] = time.monotonic()

    def fresh(self, topic):
        return int(time.monotonic()) - self.last[topic] <= self.get_parameter("patience").value

    def tell(self):
        speed = 2.0 if self.fresh("obstacles") else 0.5 if self.fresh("scan") else 0.0
        self.publisher.publish(Float64(data=speed))


def main():
    rclpy.init()
    try:
        rclpy.spin(SpeedKeeper())
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    rclpy.try_shutdown()


main()
