%%file src/car_sensors/car_sensors/speed_sensor.py
import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from std_msgs.msg import Float64
from std_srvs.srv import SetBool


class SpeedSensor(Node):
    def __init__(self):
        super().__init__("speed_sensor")
        self.service = self.create_service(SetBool, "enable", self.enable)
        self.declare_parameter("speed", 5.0)
        self.timer = self.create_timer(0.1, self.publish)
        self.open()

    def open(self):
        self.out = self.create_publisher(Float64, "speed", 10)

    def close(self):
        self.destroy_publisher(self.out)
        self.out = None

    def publish(self):
        if (out := self.out) is not None:
            out.publish(Float64(data=self.get_parameter("speed").value))

    def enable(self, request, response):
        match request.data, self.out:
            case True, None:
                self.open()
            case False, out if out is not None:
                self.close()
        response.success = True
        return response


def main():
    rclpy.init()
    sensor = SpeedSensor()
    try:
        rclpy.spin(sensor)
    except (KeyboardInterrupt, ExternalShutdownException):
        sensor.get_logger().info("bye")
    rclpy.try_shutdown()
