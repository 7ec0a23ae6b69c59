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
    DEFAULTS: Dict[str, Any] = {"camera_rate": 10, "camera_frame": "camera_frame"}

    def __init__(self) -> None:
        super().__init__("tunable_camera")
        self.config: Dict[str, Any] = {
            name: self.declare_parameter(name, value).value for name, value in self.DEFAULTS.items()
        }
        self.pending: Dict[str, Any] = {}  # what was asked for; committed after the values were set
        self.publisher = self.create_publisher(Image, "image", 10)
        self.timer: Timer = self.create_timer(1.0 / self.config["camera_rate"], self.shoot)
        self.add_on_set_parameters_callback(self.stage)
        self.add_post_set_parameters_callback(self.commit)

    def stage(self, parameters: List[Parameter]) -> SetParametersResult:
        for parameter in parameters:
            if parameter.name in self.DEFAULTS:
                self.pending[parameter.name] = parameter.value
        rate = self.pending.get("camera_rate", self.config["camera_rate"])
        asked = any(parameter.name == "camera_rate" for parameter in parameters)
        if asked and not 1 <= rate <= 60:
            reason = f"camera_rate has to be from 1 to 60, not {rate}"
            self.get_logger().warning(reason)
            return SetParametersResult(successful=False, reason=reason)
        return SetParametersResult(successful=True)

    def commit(self, parameters: List[Parameter]) -> None:
        changed, self.pending = self.pending, {}
        before = self.config["camera_rate"]
        self.config.update(changed)
        try:
            if self.config["camera_rate"] != before:
                self.destroy_timer(self.timer)
                self.timer = self.create_timer(1.0 / self.config["camera_rate"], self.shoot)
        except Exception as error:
            self.get_logger().error(f"cannot change the timer: {error}")
            self.config["camera_rate"] = before
            self.timer = self.create_timer(1.0 / before, self.shoot)

    def shoot(self) -> None:
        image = Image()
        image.header.frame_id = self.config["camera_frame"]
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
