%%node tunable_camera
import rclpy
from rcl_interfaces.msg import ParameterDescriptor, ParameterType, SetParametersResult
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.node import Node
from sensor_msgs.msg import Image


class Camera(Node):
    timer = None

    def __init__(self, **options):
        super().__init__("tunable_camera", **options)
        integer = ParameterDescriptor(type=ParameterType.PARAMETER_INTEGER)
        self.declare_parameters(namespace="", parameters=[("camera_rate", 10, integer), ("camera_frame", "camera_frame")])
        self.out = self.create_publisher(Image, "image", 1)
        self.add_on_set_parameters_callback(lambda new: self.judge({p.name: p.value for p in new}))
        self.add_post_set_parameters_callback(lambda new: "camera_rate" in [p.name for p in new] and self.begin())
        self.begin()

    @staticmethod
    def judge(new):
        fine = 0 < new.get("camera_rate", 1) < 61
        return SetParametersResult(successful=fine, reason="" if fine else "one to sixty images a second")

    def begin(self):
        if self.timer:
            self.timer.cancel()
        self.timer = self.create_timer(1 / self.get_parameter("camera_rate").get_parameter_value().integer_value, self.tick)

    def tick(self):
        msg = Image()
        msg.header.frame_id = self.get_parameter("camera_frame").get_parameter_value().string_value
        self.out.publish(msg)


def main(args=None):
    rclpy.init(args=args)
    with SingleThreadedExecutor() as executor:
        executor.add_node(Camera())
        try:
            executor.spin()
        except (KeyboardInterrupt, ExternalShutdownException):
            return 0


if __name__ == "__main__":
    raise SystemExit(main())
