"""A queue and a thread of its own do the adding; callbacks never wait."""
import queue
import threading
import time

import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from std_msgs.msg import Int64
from std_srvs.srv import Trigger


class Account:
    __slots__ = ("numbers", "publish", "total", "work")

    def __init__(self, publish, work):
        self.publish, self.work, self.total, self.numbers = publish, work, 0, queue.SimpleQueue()
        threading.Thread(target=self.run, daemon=True).start()

    def run(self):
        while True:
            number = self.numbers.get()
            time.sleep(self.work)
            self.total += number
            self.publish(Int64(data=self.total))


class Adder(Node):
    def __init__(self):
        super().__init__("adder", parameter_overrides=[])
        self.declare_parameter("work", 0.05)
        publisher = self.create_publisher(Int64, "total", 10)
        self.account = Account(publisher.publish, self.get_parameter("work").value)
        self.create_subscription(Int64, "add", lambda message: self.account.numbers.put(message.data), 10)
        self.create_service(Trigger, "get_total", self.get_total)

    def get_total(self, _, response):
        response.success, response.message = True, str(self.account.total)
        return response


def main():
    rclpy.init()
    try:
        rclpy.spin(Adder())
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        rclpy.try_shutdown()


main()
