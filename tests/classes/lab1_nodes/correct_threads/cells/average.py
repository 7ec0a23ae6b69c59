%%node average
import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from std_msgs.msg import Float64MultiArray
from std_srvs.srv import Trigger


class Average(Node):
    def __init__(self):
        super().__init__("average")
        self.mean_now = None
        self.create_subscription(Float64MultiArray, "samples", self.take, 10)
        self.create_service(Trigger, "mean", self.mean)

    def take(self, message):
        self.mean_now = sum(message.data) / len(message.data) if message.data else None

    def mean(self, request, response):
        found = self.mean_now
        return Trigger.Response(success=found is not None, message="нет чисел" if found is None else f"{found:.15e}")


def main():
    rclpy.init()
    try:
        rclpy.spin(Average())
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        rclpy.try_shutdown()


main()
