%%node arm
import time

import rclpy
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup, ReentrantCallbackGroup
from rclpy.executors import ExternalShutdownException, MultiThreadedExecutor
from rclpy.node import Node
from std_msgs.msg import Int32
from std_srvs.srv import Trigger


class Arm(Node):
    def __init__(self):
        super().__init__("arm")
        self.beats = 0
        self.heartbeat = self.create_publisher(Int32, "heartbeat", 10)
        self.create_timer(0.1, self.beat)
        self.create_service(Trigger, "grip", self.on_grip, callback_group=ReentrantCallbackGroup())

    def beat(self):
        self.beats += 1
        self.heartbeat.publish(Int32(data=self.beats))

    def on_grip(self, request, response):
        time.sleep(1.0)  # the gripper closes
        response.success = True
        return response


def main():
    rclpy.init()
    executor = MultiThreadedExecutor(num_threads=2)
    executor.add_node(Arm())
    try:
        executor.spin()
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    rclpy.try_shutdown()


main()
