%%node arm
import threading
import time

import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from std_msgs.msg import Int32
from std_srvs.srv import Trigger


class Arm(Node):
    """The heartbeat has a thread of its own, beside the one that spins."""

    def __init__(self):
        super().__init__("arm")
        self.heartbeat = self.create_publisher(Int32, "heartbeat", 10)
        self.create_service(Trigger, "grip", self.on_grip)
        self.ended = threading.Event()
        self.beater = threading.Thread(target=self.beat)
        self.beater.start()

    def beat(self):
        beats = 0
        while not self.ended.wait(0.1):
            beats += 1
            self.heartbeat.publish(Int32(data=beats))

    def on_grip(self, request, response):
        time.sleep(1.0)
        response.success = True
        return response


def main():
    rclpy.init()
    arm = Arm()
    try:
        rclpy.spin(arm)
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    arm.ended.set()
    arm.beater.join()
    rclpy.try_shutdown()


main()
