import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from std_msgs.msg import Float64MultiArray
from std_srvs.srv import Trigger


class Average(Node):
    def __init__(self):
        super().__init__("average")
        self.samples = []
        self.create_subscription(Float64MultiArray, "samples", self.take, 10)
        self.create_service(Trigger, "mean", self.mean)

    def take(self, message):
        self.samples = message.data

    def mean(self, request, response):
        response.success = len(self.samples) > 0
        if response.success:
            response.message = str(sum(self.samples) / len(self.samples))
        else:
            response.message = "there are no numbers"
        self.samples = []
        return response


def main():
    rclpy.init()
    try:
        rclpy.spin(Average())
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        rclpy.try_shutdown()


main()
