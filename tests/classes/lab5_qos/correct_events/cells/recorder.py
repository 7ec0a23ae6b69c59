%%node recorder
"""Takes frames at once and works on them in a thread of its own."""
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
        self.declare_parameter("work", 0.02)
        self.frames = queue.SimpleQueue()
        self.publisher = self.create_publisher(Int32, "recorded", 10)
        self.create_subscription(Int32, "frames", self.frames.put, QoSProfile(depth=200))
        self.worker = threading.Thread(target=self.work)
        self.worker.start()

    def work(self):
        while (frame := self.frames.get()) is not None:
            time.sleep(self.get_parameter("work").value)
            self.publisher.publish(frame)


def main():
    rclpy.init()
    node = Recorder()
    try:
        rclpy.spin(node)
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    node.frames.put(None)
    node.worker.join()


main()
