%%node tunable_camera
import rclpy
from rcl_interfaces.msg import IntegerRange, ParameterDescriptor, SetParametersResult
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from sensor_msgs.msg import Image


class TunableCamera(Node):
    def __init__(self):
        super().__init__("tunable_camera")
        self.declare_parameter("camera_rate", 10, ParameterDescriptor(dynamic_typing=True))
        self.declare_parameter("camera_frame", "camera_frame")
        self.images = self.create_publisher(Image, "image", 10)
        self.timer = self.create_timer(1.0 / self.get_parameter("camera_rate").value, self.shoot)
        self.add_on_set_parameters_callback(self.check)
        self.add_post_set_parameters_callback(self.follow)

    def check(self, parameters):
        for parameter in parameters:
            if parameter.name == "camera_rate":
                if not isinstance(parameter.value, int) or not 1 <= parameter.value <= 60:
                    return SetParametersResult(successful=False, reason="camera_rate: an integer from 1 to 60")
            if parameter.name == "camera_frame" and not isinstance(parameter.value, str):
                return SetParametersResult(successful=False, reason="camera_frame: a text")
        return SetParametersResult(successful=True)

    def follow(self, parameters):
        for parameter in parameters:
            if parameter.name == "camera_rate":
                self.timer.timer_period_ns = int(1e9 / parameter.value)

    def shoot(self):
        image = Image()
        image.header.frame_id = self.get_parameter("camera_frame").value
        self.images.publish(image)


def main():
    rclpy.init()
    try:
        rclpy.spin(TunableCamera())
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        rclpy.try_shutdown()


if __name__ == "__main__":
    main()
