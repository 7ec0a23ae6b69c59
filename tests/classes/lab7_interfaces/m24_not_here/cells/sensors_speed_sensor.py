%%file src/car_sensors/car_sensors/speed_sensor.py
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
        self.create_service(SetBool, "enable", self.enable)
        self.create_timer(0.1, self.measure)

    def measure(self):
        if self.enabled:
            self.publisher.publish(Float64(data=self.speed))

    def enable(self, request, response):
        self.enabled = request.data
        if not self.enabled:
            self.publisher.publish(Float64(data=0.0))  # nobody may keep an old speed
        response.success = True
        return response


def main():
    rclpy.init()
    try:
        rclpy.spin(SpeedSensor())
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    rclpy.try_shutdown()
