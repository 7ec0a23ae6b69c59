%%node picture_age
import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from sensor_msgs.msg import Image
from std_msgs.msg import Float64


class PictureAge(Node):
    def __init__(self):
        super().__init__("picture_age")
        self.publisher = self.create_publisher(Float64, "age", 10)
        self.create_subscription(Image, "camera/image", self.look, 10)

    def look(self, image):
        stamp = image.header.stamp
        self.publisher.publish(Float64(data=self.get_clock().now().to_msg().sec - (stamp.sec + stamp.nanosec / 1e9)))


def main():
    rclpy.init()
    try:
        rclpy.spin(PictureAge())
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        rclpy.try_shutdown()


main()
