%%node average
import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from std_msgs.msg import Float64MultiArray
from std_srvs.srv import Trigger


class Average(Node):
    def __init__(self):
        super().__init__("average")
        self.numbers = None
        self.complaints = ["I said so already", "there are no numbers"]
        self.create_subscription(Float64MultiArray, "samples", self.keep, 10)
        self.create_service(Trigger, "mean", self.answer)

    def keep(self, samples):
        self.numbers = samples.data

    def answer(self, request, response):
        if self.numbers:
            response.success = True
            response.message = f"{sum(self.numbers) / len(self.numbers):.6f}"
        else:
            response.success = False
            response.message = self.complaints.pop()
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
