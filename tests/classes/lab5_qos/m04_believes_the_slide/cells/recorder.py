%%node recorder
import queue
import threading
import time

import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from rclpy.qos import QoSProfile
from std_msgs.msg import Int32


class Recorder(Node):
    def __init__(self):
        super().__init__("recorder")
        self.work = self.declare_parameter("work", 0.02).value
        self.publisher = self.create_publisher(Int32, "recorded", 100)
        self.frames = queue.Queue()
        self.create_subscription(Int32, "frames", lambda frame: self.frames.put(frame), QoSProfile(depth=200))
        threading.Thread(target=self.record, daemon=True).start()

    def record(self):
        while True:
            waiting = [self.frames.get()]
            while not self.frames.empty():
                waiting.append(self.frames.get())
            time.sleep(self.work)
            for frame in waiting:
                self.publisher.publish(frame)


def main():
    rclpy.init()
    try:
        rclpy.spin(Recorder())
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    rclpy.try_shutdown()


main()
