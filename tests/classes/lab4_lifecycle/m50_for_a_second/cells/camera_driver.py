%%node camera_driver
import rclpy
from camera_hardware import CameraHardware
from rclpy.executors import ExternalShutdownException
from rclpy.lifecycle import LifecycleNode, TransitionCallbackReturn
from sensor_msgs.msg import Image
from std_msgs.msg import String


class CameraDriver(LifecycleNode):
    def __init__(self):
        super().__init__("camera_driver")
        self.declare_parameter("device", "/dev/zero")
        self.declare_parameter("fps", 10.0)
        self.camera = None
        self.image_pub = None
        self.shutter = None
        self.status_pub = self.create_publisher(String, "status", 10)
        self.status_timer = self.create_timer(0.1, self.tell_status)

    def on_configure(self, state):
        camera = CameraHardware(self, self.get_parameter("device").value)
        try:
            camera.open()
        except OSError as error:
            self.get_logger().warning(f"not configured: {error}")
            return TransitionCallbackReturn.FAILURE
        self.camera = camera
        self.image_pub = self.create_lifecycle_publisher(Image, "image", 10)
        fps = self.get_parameter("fps").value
        self.shutter = self.create_timer(1.0 / fps, self.take_picture, autostart=False)
        return TransitionCallbackReturn.SUCCESS

    def on_activate(self, state):
        try:
            self.camera.read()
        except OSError as error:
            self.get_logger().error(f"broken: {error}")
            return TransitionCallbackReturn.ERROR
        self.shutter.reset()
        return super().on_activate(state)

    def on_deactivate(self, state):
        self.shutter.cancel()
        return super().on_deactivate(state)

    def on_cleanup(self, state):
        return self.give_back()

    def on_error(self, state):
        return self.give_back()

    def on_shutdown(self, state):
        self.give_back()
        self.create_timer(1.0, rclpy.try_shutdown)  # there is nothing left to do
        return TransitionCallbackReturn.SUCCESS

    def give_back(self):
        if self.shutter is not None:
            self.destroy_timer(self.shutter)
            self.shutter = None
        if self.image_pub is not None:
            self.destroy_lifecycle_publisher(self.image_pub)
            self.image_pub = None
        if self.camera is not None:
            self.camera.close()
            self.camera = None
        return TransitionCallbackReturn.SUCCESS

    def take_picture(self):
        data = self.camera.read()
        image = Image(height=8, width=8, encoding="mono8", step=8, data=data)
        image.header.stamp = self.get_clock().now().to_msg()
        self.image_pub.publish(image)

    def tell_status(self):
        self.status_pub.publish(String(data="closed" if self.camera is None else "open"))


def main():
    rclpy.init()
    node = CameraDriver()
    try:
        rclpy.spin(node)
    except (KeyboardInterrupt, ExternalShutdownException):
        pass


main()
