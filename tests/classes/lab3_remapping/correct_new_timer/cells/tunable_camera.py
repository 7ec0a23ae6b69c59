%%node tunable_camera
import rclpy
from rcl_interfaces.msg import IntegerRange, ParameterDescriptor, SetParametersResult
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from sensor_msgs.msg import Image


class TunableCamera(Node):
    def __init__(self):
        super().__init__("tunable_camera")
        limits = ParameterDescriptor(integer_range=[IntegerRange(from_value=1, to_value=60, step=1)])
        self.declare_parameters("", [("camera_rate", 10, limits), ("camera_frame", "camera_frame")])
        self.images = self.create_publisher(Image, "image", 10)
        self.timer = None
        self.restart(self.get_parameter("camera_rate").value)
        self.add_on_set_parameters_callback(self.on_set)

    def restart(self, rate):
        if self.timer:
            self.destroy_timer(self.timer)
        self.timer = self.create_timer(1.0 / rate, self.shoot)

    def on_set(self, parameters):
        for parameter in parameters:
            if parameter.name == "camera_rate":
                self.restart(parameter.value)
        return SetParametersResult(successful=True)

    def shoot(self):
        image = Image()
        image.header.frame_id = self.get_parameter("camera_frame").value
        self.images.publish(image)


def main():
    rclpy.init()
    node = TunableCamera()
    try:
        rclpy.spin(node)
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        node.destroy_node()
        rclpy.try_shutdown()


if __name__ == "__main__":
    main()
