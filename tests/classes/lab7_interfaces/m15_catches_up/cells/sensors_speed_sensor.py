%%file src/car_sensors/car_sensors/speed_sensor.py
import time

import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from std_msgs.msg import Float64
from std_srvs.srv import SetBool


class SpeedSensor(Node):
    def __init__(self):
        super().__init__("speed_sensor")
        self.speed = self.declare_parameter("speed", 5.0).value
        self.enabled = True
        self.publisher = self.create_publisher(Float64, "speed", 10)
        self.create_service(SetBool, "enable", self.on_enable)
        self.sent = 0
        self.began = time.monotonic()
        self.create_timer(0.1, self.tick)

    def tick(self):
        # keep the rate exact: send as many as are due
        while self.enabled and self.sent < int((time.monotonic() - self.began) / 0.1):
            self.sent += 1
            self.publisher.publish(Float64(data=self.speed))

    def on_enable(self, request, response):
        self.enabled = request.data
        response.success = True
        return response


def main():
    rclpy.init()
    try:
        rclpy.spin(SpeedSensor())
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    rclpy.try_shutdown()
