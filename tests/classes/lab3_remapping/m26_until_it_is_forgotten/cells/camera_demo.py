%%node camera_demo
import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from rclpy.duration import Duration
from sensor_msgs.msg import Image
from std_msgs.msg import Bool, String


class CameraDemo(Node):
    def __init__(self):
        super().__init__("camera_demo")
        self.declare_parameter("camera_name", "camera")
        self.declare_parameter("camera_rate", 10)  # images per second, an integer
        self.declare_parameter("camera_frame", "camera_frame")
        self.stopped = False
        self.stopped_at = None
        self.images = self.create_publisher(Image, "camera/image_color", 10)
        self.status = self.create_publisher(String, "~/status", 10)
        self.create_subscription(Bool, "/emergency_stop", self.on_stop, 10)
        self.create_timer(1.0 / self.get_parameter("camera_rate").value, self.shoot)

    def on_stop(self, msg):
        self.stopped = msg.data
        self.stopped_at = self.get_clock().now()

    def shoot(self):
        if self.stopped and self.get_clock().now() - self.stopped_at > Duration(seconds=2):
            self.stopped = False  # the one who stopped us is gone
        self.status.publish(String(data=self.get_parameter("camera_name").value))
        if not self.stopped:
            image = Image()
            image.header.frame_id = self.get_parameter("camera_frame").value
            self.images.publish(image)


def main():
    rclpy.init()
    try:
        rclpy.spin(CameraDemo())
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        rclpy.try_shutdown()


if __name__ == "__main__":
    main()
