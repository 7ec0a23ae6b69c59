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
        self.last = None
        self.publisher = self.create_publisher(Float64, "age", 10)
        self.create_subscription(Image, "camera/image", self.say, 10)

    def say(self, picture):
        if picture.header.stamp == self.last:
            return  # the same picture again
        self.last = picture.header.stamp
        age = self.get_clock().now() - Time.from_msg(picture.header.stamp)
        self.publisher.publish(Float64(data=age.nanoseconds / 1e9))


def main():
    rclpy.init()
    try:
        rclpy.spin(PictureAge())
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        rclpy.try_shutdown()


main()
