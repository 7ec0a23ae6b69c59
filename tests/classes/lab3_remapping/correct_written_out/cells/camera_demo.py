%%node camera_demo
import rclpy
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from sensor_msgs.msg import Image
from std_msgs.msg import Bool, String


class Camera:
    """Has a node instead of being one; the timer stands still while the car is stopped."""

    def __init__(self):
        self.node = rclpy.create_node("camera_demo")
        for name, value in dict(camera_name="camera", camera_rate=10, camera_frame="camera_frame").items():
            setattr(self, name, self.node.declare_parameter(name, value).value)
        self.images = self.node.create_publisher(Image, "camera/image_color", 10)
        self.status = self.node.create_publisher(String, "~/status", 10)
        self.stop = self.node.create_subscription(Bool, "/emergency_stop", self.on_stop, 10)
        self.beat = self.node.create_timer(1.0 / self.camera_rate, lambda: self.status.publish(String(data=self.camera_name)))
        self.timer = self.node.create_timer(1.0 / self.camera_rate, self.shoot)

    def on_stop(self, msg):
        self.timer.cancel() if msg.data else self.timer.reset()

    def shoot(self):
        image = Image()
        image.header.frame_id = self.camera_frame
        self.images.publish(image)


def main():
    rclpy.init()
    executor = SingleThreadedExecutor()
    executor.add_node(Camera().node)
    try:
        executor.spin()
    except (KeyboardInterrupt, ExternalShutdownException):
        pass


if __name__ == "__main__":
    main()
