%%node camera
import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from sensor_msgs.msg import Image

WIDTH, HEIGHT = 32, 24


class Camera(Node):
    def __init__(self):
        super().__init__("camera")
        self.pub = self.create_publisher(Image, "camera/image", 10)
        self.started = self.get_clock().now()
        self.create_timer(0.1, self.snap)

    def snap(self):
        im = Image(width=WIDTH, height=HEIGHT, encoding="rgb8", step=WIDTH * 3)
        im.data = bytes(im.step * im.height)
        im.header.frame_id = "camera_link"
        age = (self.get_clock().now() - self.started).nanoseconds
        im.header.stamp.sec, im.header.stamp.nanosec = divmod(age, 10**9)
        self.pub.publish(im)


def main():
    rclpy.init()
    try:
        rclpy.spin(Camera())
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        rclpy.try_shutdown()


main()
