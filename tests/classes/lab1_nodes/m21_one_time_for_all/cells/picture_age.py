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
        self.publisher = self.create_publisher(Float64, "age", 10)
        self.create_subscription(Image, "camera/image", self.look, 10)

    def look(self, image):
        age = self.get_clock().now() - Time.from_msg(image.header.stamp)
        self.publisher.publish(Float64(data=round(age.nanoseconds / 1e9, 2)))


def main():
    rclpy.init()
    try:
        rclpy.spin(PictureAge())
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        rclpy.try_shutdown()


main()
