%%node range_sensor
import rclpy
from rclpy.duration import Duration
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import Range


class RangeSensor(Node):
    def __init__(self):
        super().__init__("range_sensor")
        offered = QoSProfile(depth=5, reliability=ReliabilityPolicy.BEST_EFFORT, deadline=Duration(seconds=0.02))
        self.publisher = self.create_publisher(Range, "range", offered)
        self.create_timer(0.05, lambda: self.publisher.publish(Range(range=1.0)))


def main():
    rclpy.init()
    try:
        rclpy.spin(RangeSensor())
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    rclpy.try_shutdown()


main()
