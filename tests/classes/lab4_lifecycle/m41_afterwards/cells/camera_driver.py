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
        self.camera = CameraHardware(self, self.get_parameter("device").value)
        self.opened = False
        self.image = None
        self.timer = None
        self.status = self.create_publisher(String, "status", 10)
        self.create_timer(0.1, self.publish_status)

    def on_configure(self, state):
        self.camera = CameraHardware(self, self.get_parameter("device").value)
        try:
            self.camera.open()
        except OSError:
            return TransitionCallbackReturn.FAILURE
        self.opened = True
        self.image = self.create_lifecycle_publisher(Image, "image", 10)
        return TransitionCallbackReturn.SUCCESS

    def on_activate(self, state):
        try:
            self.camera.read()
        except OSError:
            return TransitionCallbackReturn.ERROR
        self.timer = self.create_timer(1.0 / self.get_parameter("fps").value, self.publish_image)
        return super().on_activate(state)

    def on_deactivate(self, state):
        self.destroy_timer(self.timer)
        self.timer = None
        return super().on_deactivate(state)

    def on_cleanup(self, state):
        self.release()
        return TransitionCallbackReturn.SUCCESS

    def on_shutdown(self, state):
        self.camera.close()  # first of all
        self.release()
        return TransitionCallbackReturn.SUCCESS

    def on_error(self, state):
        self.release()
        return TransitionCallbackReturn.SUCCESS

    def release(self):
        if self.timer is not None:
            self.destroy_timer(self.timer)
            self.timer = None
        if self.camera is not None:
            self.camera.close()
            self.camera = None
        self.opened = False
        if self.image is not None:
            self.destroy_lifecycle_publisher(self.image)
            self.image = None

    def publish_status(self):
        self.status.publish(String(data="open" if self.opened else "closed"))

    def publish_image(self):
        image = Image(height=8, width=8, encoding="mono8", step=8)
        image.data = self.camera.read()
        self.image.publish(image)


def main():
    rclpy.init()
    node = CameraDriver()
    try:
        rclpy.spin(node)
    except (KeyboardInterrupt, ExternalShutdownException):
        pass


main()
