%%node sensor_monitor
import rclpy
from rclpy.duration import Duration
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy, qos_profile_sensor_data
from sensor_msgs.msg import Temperature
from std_msgs.msg import Int64MultiArray


class SensorMonitor(Node):
    def __init__(self):
        super().__init__("sensor_monitor")
        self.sent = 0
        self.heard = {"display": 0, "logger": 0, "alarm": 0}
        self.counts = self.create_publisher(Int64MultiArray, "counts", 10)
        offered = QoSProfile(depth=5, reliability=ReliabilityPolicy.BEST_EFFORT, deadline=Duration(seconds=0.2))
        alarm = QoSProfile(depth=5, reliability=ReliabilityPolicy.BEST_EFFORT, deadline=Duration(seconds=0.2))
        self.publisher = self.create_publisher(Temperature, "temperature", offered)
        for name, profile in (("display", qos_profile_sensor_data), ("logger", qos_profile_sensor_data), ("alarm", alarm)):
            self.create_subscription(Temperature, "temperature", lambda m, name=name: self.count(name, m), profile)
        self.create_timer(0.1, self.measure)

    def count(self, name, message):
        self.heard[name] += 1

    def measure(self):
        self.counts.publish(Int64MultiArray(data=[self.sent] * 4))
        self.publisher.publish(Temperature(temperature=20.0 + self.sent % 5))
        self.sent += 1


def main():
    rclpy.init()
    try:
        rclpy.spin(SensorMonitor())
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    rclpy.try_shutdown()


main()
