%%node average
import threading
from collections import deque

import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from std_msgs.msg import Float64MultiArray
from std_srvs.srv import Trigger


class Average(Node):
    MAX_SAMPLES = 100  # fixed memory, as on the real controller

    def __init__(self):
        super().__init__("average")
        self.mutex = threading.Lock()
        self.buffer = deque(maxlen=self.MAX_SAMPLES)
        self.received = False
        self.create_subscription(Float64MultiArray, "samples", self.on_samples, 10)
        self.create_service(Trigger, "mean", self.on_mean)

    def on_samples(self, msg):
        with self.mutex:
            self.received = True
            self.buffer.clear()
            self.buffer.extend(msg.data)

    def on_mean(self, request, response):
        with self.mutex:
            values = list(self.buffer)
        if values:
            response.success = True
            response.message = repr(sum(values) / len(values))
        else:
            response.success = False
            response.message = "the last list was empty" if self.received else "no list has come yet"
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
