%%node tunable_camera
import rclpy
from rcl_interfaces.msg import SetParametersResult
from rclpy.executors import ExternalShutdownException, MultiThreadedExecutor
from rclpy.parameter import Parameter
from sensor_msgs.msg import Image

RATES = range(1, 61)


class Tunable:
    __slots__ = ("node", "images", "timer", "rate", "frame")

    def __init__(self, node):
        self.node = node
        self.rate = node.declare_parameter("camera_rate", 10).value
        self.frame = node.declare_parameter("camera_frame", "camera_frame").value
        self.images = node.create_publisher(Image, "image", 10)
        self.timer = node.create_timer(1 / self.rate, self.shoot)
        node.add_on_set_parameters_callback(self.on_set)

    def on_set(self, parameters):
        wanted = {one.name: one.value for one in parameters}
        rate = wanted.get("camera_rate", self.rate)
        if rate not in RATES:
            return SetParametersResult(successful=False, reason=f"{rate} images a second: not in 1..60")
        self.frame = wanted.get("camera_frame", self.frame)
        if rate != self.rate:
            self.rate = rate
            self.timer.timer_period_ns = 10**9 // rate
            self.timer.reset()
        return SetParametersResult(successful=True)

    def shoot(self):
        image = Image()
        image.header.frame_id = self.frame
        image.header.stamp = self.node.get_clock().now().to_msg()
        self.images.publish(image)


def main():
    rclpy.init()
    tunable = Tunable(rclpy.create_node("tunable_camera"))
    executor = MultiThreadedExecutor(num_threads=2)
    executor.add_node(tunable.node)
    try:
        executor.spin()
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        rclpy.try_shutdown()


main()
