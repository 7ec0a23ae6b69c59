%%node average
import numpy as np
import rclpy
from rclpy.executors import ExternalShutdownException, MultiThreadedExecutor
from rclpy.node import Node
from std_msgs.msg import Float64MultiArray
from std_srvs.srv import Trigger


class Average:
    """Has a node instead of being one."""

    def __init__(self):
        self.node = Node("average")
        self.samples = None
        self.node.create_subscription(Float64MultiArray, "samples", self.take, 10)
        self.node.create_service(Trigger, "mean", self.mean)

    def take(self, message):
        self.samples = np.array(message.data)

    def mean(self, _, response):
        try:
            response.message = str(float(sum(self.samples) / len(self.samples)))
            response.success = bool(np.isfinite(float(response.message)))
        except (TypeError, ZeroDivisionError):
            pass
        if not response.success:
            response.message = "no mean without samples"
        return response


rclpy.init()
executor = MultiThreadedExecutor(num_threads=3)
executor.add_node(Average().node)
try:
    executor.spin()
except (KeyboardInterrupt, ExternalShutdownException):
    pass
