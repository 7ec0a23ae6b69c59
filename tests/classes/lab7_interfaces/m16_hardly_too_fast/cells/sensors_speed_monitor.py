%%file src/car_sensors/car_sensors/speed_monitor.py
import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from std_msgs.msg import Bool, Float64

EPSILON = 1e-3  # m/s; floats are never compared without a tolerance


def greater(a, b):
    return a - b > EPSILON


class SpeedMonitor(Node):
    def __init__(self):
        super().__init__("speed_monitor")
        self.limit = float(self.declare_parameter("limit", 13.9).value)
        self.pub = self.create_publisher(Bool, "too_fast", 10)
        self.sub = self.create_subscription(Float64, "speed", self.on_speed, 10)

    def on_speed(self, msg):
        self.pub.publish(Bool(data=greater(msg.data, self.limit)))


def main():
    rclpy.init()
    try:
        rclpy.spin(SpeedMonitor())
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    rclpy.try_shutdown()
