%%node camera
import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from sensor_msgs.msg import Image

WIDTH, HEIGHT = 32, 24


class Camera(Node):
    def __init__(self):
        super().__init__("camera")
        self.publisher = self.create_publisher(Image, "camera/image", 10)
        self.create_timer(0.1, self.take)

    def take(self):
        image = Image(width=WIDTH, height=HEIGHT, encoding="rgb8", step=3 * WIDTH)
        image.header.stamp = self.get_clock().now().to_msg()
        image.header.frame_id = "camera_link"
        image.data = bytes(WIDTH * HEIGHT)
        self.publisher.publish(image)


def main():
    rclpy.init()
    try:
        rclpy.spin(Camera())
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        rclpy.try_shutdown()


main()
