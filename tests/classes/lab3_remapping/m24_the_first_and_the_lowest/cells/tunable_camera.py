%%node tunable_camera
import rclpy
from rcl_interfaces.msg import SetParametersResult
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from sensor_msgs.msg import Image


class TunableCamera(Node):
    def __init__(self):
        super().__init__("tunable_camera")
        self.declare_parameter("camera_rate", 10)
        self.declare_parameter("camera_frame", "camera_frame")
        self.frame, self.sent = "camera_frame", 0
        profile = QoSProfile(depth=10, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        self.images = self.create_publisher(Image, "image", profile)
        self.timer = self.create_timer(1.0 / self.get_parameter("camera_rate").value, self.shoot)
        self.add_on_set_parameters_callback(self.validate)
        self.add_post_set_parameters_callback(self.update)

    def validate(self, parameters):
        for parameter in parameters:
            if parameter.name == "camera_rate" and not 1 <= parameter.value <= 60:
                return SetParametersResult(successful=False, reason="camera_rate must be from 1 to 60 images per second")
        return SetParametersResult(successful=True)

    def update(self, parameters):
        for parameter in parameters:
            if parameter.name == "camera_rate" and parameter.value > 1:
                self.timer.timer_period_ns = int(1e9 / parameter.value)

    def shoot(self):
        image = Image()
        image.header.frame_id = self.frame
        self.images.publish(image)
        self.sent += 1
        if self.sent > 6:
            self.frame = self.get_parameter("camera_frame").value


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
