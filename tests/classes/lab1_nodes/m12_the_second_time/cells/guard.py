import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from std_msgs.msg import Bool, Float64, Int64


class Guard(Node):
    def __init__(self):
        super().__init__("guard")
        self.low = self.create_publisher(Bool, "charge_low", 10)
        self.create_subscription(Float64, "charge", self.judge, 10)

    def judge(self, charge):
        low = charge.data < 20
        if low != getattr(self, "was", None):
            self.was = low
            self.low.publish(Bool(data=low))


def main():
    rclpy.init()
    try:
        rclpy.spin(Guard())
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        rclpy.try_shutdown()


main()
