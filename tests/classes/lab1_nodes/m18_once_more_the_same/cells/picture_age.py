%%node picture_age
import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from rclpy.time import Time
from sensor_msgs.msg import Image
from std_msgs.msg import Float64


class PictureAge(Node):
    def __init__(self):
        super().__init__("picture_age")
        self.age = self.create_publisher(Float64, "age", 10)
        self.create_subscription(Image, "camera/image", self.on_image, 10)

    def on_image(self, image):
        stamp = Time.from_msg(image.header.stamp, clock_type=self.get_clock().clock_type)
        if stamp.nanoseconds == 0:
            self.get_logger().warn("a picture without a stamp")
            return
        passed = self.get_clock().now() - stamp
        self.age.publish(Float64(data=passed.nanoseconds / 1e9))


def main():
    rclpy.init()
    try:
        rclpy.spin(PictureAge())
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        rclpy.try_shutdown()


main()
