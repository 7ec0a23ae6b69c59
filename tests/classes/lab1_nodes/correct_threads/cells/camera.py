%%node camera
import threading
import time

import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from sensor_msgs.msg import Image

WIDTH, HEIGHT = 32, 24


class Camera(Node):
    def __init__(self):
        super().__init__("camera")
        self.publisher = self.create_publisher(Image, "camera/image", 10)
        self.image = Image(width=WIDTH, height=HEIGHT, encoding="rgb8", step=3 * WIDTH)
        self.image.header.frame_id = "camera_link"
        self.image.data = b"\x10\x20\x30" * (WIDTH * HEIGHT)
        threading.Thread(target=self.take, daemon=True).start()

    def take(self):
        due = time.monotonic()
        while rclpy.ok():
            self.image.header.stamp = self.get_clock().now().to_msg()
            self.publisher.publish(self.image)
            due += 0.1
            time.sleep(max(0.0, due - time.monotonic()))


def main():
    rclpy.init()
    try:
        rclpy.spin(Camera())
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        rclpy.try_shutdown()


main()
