%%file src/car_sensors/car_sensors/speed_sensor.py
import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from std_msgs.msg import Float64
from std_srvs.srv import SetBool

import threading


class Loop:
    """Publishes from a thread of its own, while it may."""

    def __init__(self, node: Node) -> None:
        self.value = node.declare_parameter("speed", 5.0).get_parameter_value().double_value
        self.topic = node.create_publisher(Float64, "speed", 10)
        self.may = threading.Event()
        self.may.set()
        self.over = threading.Event()
        node.create_service(SetBool, "enable", self.enable)
        self.thread = threading.Thread(target=self.run)

    def enable(self, request: SetBool.Request, response: SetBool.Response) -> SetBool.Response:
        if request.data:
            self.may.set()
        else:
            self.may.clear()
        return SetBool.Response(success=True)

    def run(self) -> None:
        while not self.over.wait(0.1):
            if self.may.is_set():
                self.topic.publish(Float64(data=self.value))


def main():
    rclpy.init()
    node = Node("speed_sensor")
    loop = Loop(node)
    loop.thread.start()
    try:
        rclpy.spin(node)
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        loop.over.set()
        loop.thread.join()
        rclpy.try_shutdown()
