%%node arm
import threading

import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from std_msgs.msg import Int32
from std_srvs.srv import Trigger


class Arm(Node):
    def __init__(self):
        super().__init__("arm")
        self.beats = 0
        self.heartbeat = self.create_publisher(Int32, "heartbeat", 10)
        self.create_timer(0.1, self.beat)
        self.create_service(Trigger, "grip", self.on_grip)

    def beat(self):
        self.beats += 1
        self.heartbeat.publish(Int32(data=self.beats))

    def on_grip(self, request, response):
        for _ in range(4):  # the gripper closes by a quarter
            threading.Event().wait(0.25)
            self.beat()
        response.success = True
        return response


def main():
    rclpy.init()
    try:
        rclpy.spin(Arm())
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    rclpy.try_shutdown()


main()
