import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from std_msgs.msg import Bool, Float64


class SpeedMonitor(Node):
    limit = property(lambda self: self.get_parameter("limit").value)

    def __init__(self, **given):
        super().__init__("speed_monitor", **given)
        self.declare_parameters("", [("limit", 13.9)])
        self.out = self.create_publisher(Bool, "too_fast", 10)
        self.ends = self.create_subscription(Float64, "speed", lambda m: self.out.publish(Bool(data=m.data > self.limit)), 10)

    @classmethod
    def main(cls):
        rclpy.init()
        try:
            rclpy.spin(cls())
        except (KeyboardInterrupt, ExternalShutdownException):
            pass
        finally:
            rclpy.try_shutdown()
