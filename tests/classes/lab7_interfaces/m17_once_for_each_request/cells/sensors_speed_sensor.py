%%file src/car_sensors/car_sensors/speed_sensor.py
import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from std_msgs.msg import Float64
from std_srvs.srv import SetBool



class SpeedSensor(Node):
    def __init__(self):
        super().__init__("speed_sensor")
        self.declare_parameter("speed", 5.0)
        self.enabled = True
        self.publisher = self.create_publisher(Float64, "speed", 10)
        self.create_service(SetBool, "enable", self.enable)
        self.timer = self.create_timer(0.1, self.measure)

    def enable(self, request, response):
        if request.data and not self.enabled:
            self.destroy_timer(self.timer)
            self.timer = self.create_timer(0.2, self.measure)
        self.enabled = request.data
        response.success = True
        return response

    def measure(self):
        if self.enabled:
            self.publisher.publish(Float64(data=self.get_parameter("speed").value))


def main():
    rclpy.init()
    try:
        rclpy.spin(SpeedSensor())
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    rclpy.try_shutdown()
