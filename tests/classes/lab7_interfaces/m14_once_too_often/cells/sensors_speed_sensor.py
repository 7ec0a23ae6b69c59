%%file src/car_sensors/car_sensors/speed_sensor.py
import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from std_msgs.msg import Float64
from std_srvs.srv import SetBool


class SpeedSensor(Node):
    def __init__(self):
        super().__init__("speed_sensor")
        self.speed = self.declare_parameter("speed", 5.0)
        self.enabled = True
        self.publisher = self.create_publisher(Float64, "speed", 10)
        self.create_service(SetBool, "enable", self.on_enable)
        self.create_timer(0.1, self.tick)

    def tick(self):
        if self.enabled:
            self.publisher.publish(Float64(data=self.speed.value))

    def on_enable(self, request, response):
        if request.data:
            self.enabled = True
        else:
            self.enabled = not self.enabled
        response.success = True
        return response


def main():
    rclpy.init()
    try:
        rclpy.spin(SpeedSensor())
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    rclpy.try_shutdown()
