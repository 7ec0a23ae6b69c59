%%node tunable_camera
from typing import Any, Callable, Dict, List, Optional

import rclpy
from rcl_interfaces.msg import SetParametersResult
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.timer import Timer
from sensor_msgs.msg import Image


class TunableCamera(Node):
    def __init__(self) -> None:
        super().__init__("tunable_camera")
        self.declare_parameter("camera_rate", 10)
        self.declare_parameter("camera_frame", "camera_frame")
        self.rate: int = self.get_parameter("camera_rate").value
        self.frame: str = self.get_parameter("camera_frame").value
        self.good_frame: str = self.frame  # the last known good value, for the roll-back
        self.publisher = self.create_publisher(Image, "image", 10)
        self.timer: Timer = self.create_timer(1.0 / self.rate, self.shoot)
        self.add_on_set_parameters_callback(self.validate)
        self.add_post_set_parameters_callback(self.update)

    def check_rate(self, rate: int) -> None:
        if not 1 <= rate <= 60:
            raise ValueError(f"camera_rate must be from 1 to 60, got {rate}")

    def validate(self, parameters: List[Parameter]) -> SetParametersResult:
        try:
            for parameter in parameters:
                if parameter.name == "camera_rate":
                    self.check_rate(parameter.value)
        except ValueError as error:
            self.get_logger().warning(f"refused, rolling back: {error}")
            self.frame = self.good_frame
            return SetParametersResult(successful=False, reason=str(error))
        return SetParametersResult(successful=True)

    def update(self, parameters: List[Parameter]) -> None:
        for parameter in parameters:
            if parameter.name == "camera_frame":
                self.frame = parameter.value
            elif parameter.name == "camera_rate":
                self.rate = parameter.value
                self.destroy_timer(self.timer)
                self.timer = self.create_timer(1.0 / self.rate, self.shoot)

    def shoot(self) -> None:
        image = Image()
        image.header.frame_id = self.frame
        self.publisher.publish(image)


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
