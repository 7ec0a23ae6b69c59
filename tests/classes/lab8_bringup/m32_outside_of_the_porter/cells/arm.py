%%node arm
"""A heartbeat, and a service that takes a second."""

import threading
import time

import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from std_msgs.msg import Int32
from std_srvs.srv import Trigger


class Arm(Node):
    def __init__(self):
        super().__init__("arm")
        self.beats, self.over = 0, threading.Event()
        self.heartbeat = self.create_publisher(Int32, "heartbeat", 10)
        self.create_timer(0.1, self.beat)
        self.create_service(Trigger, "grip", self.on_grip)

    def beat(self):
        self.beats += 1
        self.heartbeat.publish(Int32(data=self.beats))

    def on_grip(self, request, response):
        threading.Thread(target=self.beat_on, daemon=True).start()
        time.sleep(1.0)  # the gripper closes
        response.success = True
        return response

    def beat_on(self):
        # the timer cannot beat now
        while not self.over.wait(0.1):
            self.beat()


def main():
    rclpy.init()
    try:
        rclpy.spin(Arm())
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    rclpy.try_shutdown()


main()
