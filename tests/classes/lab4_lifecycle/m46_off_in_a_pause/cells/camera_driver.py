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
        self.paused = False
        self.image_publisher = None
        self.frame_timer = None
        self.status_publisher = self.create_publisher(String, "status", 10)
        self.status_timer = self.create_timer(0.1, self.publish_status)

    def publish_status(self):
        self.status_publisher.publish(String(data="closed" if self.camera is None else "open"))

    def publish_frame(self):
        self.image_publisher.publish(
            Image(height=8, width=8, encoding="mono8", step=8, data=self.camera.read())
        )

    def on_configure(self, state):
        camera = CameraHardware(self, self.get_parameter("device").value)
        try:
            camera.open()
        except OSError as error:
            self.get_logger().warning(f"cannot open the camera: {error}")
            return TransitionCallbackReturn.FAILURE
        self.camera = camera
        self.paused = False
        self.image_publisher = self.create_lifecycle_publisher(Image, "image", 10)
        return TransitionCallbackReturn.SUCCESS

    def on_activate(self, state):
        try:
            if self.paused:
                self.camera.open()
                self.paused = False
            self.camera.read()
        except OSError as error:
            self.get_logger().error(f"the camera is broken: {error}")
            return TransitionCallbackReturn.ERROR
        self.frame_timer = self.create_timer(1.0 / int(self.get_parameter("fps").value), self.publish_frame)
        return super().on_activate(state)

    def on_deactivate(self, state):
        self.destroy_timer(self.frame_timer)
        self.camera.close()  # saves power
        self.paused = True
        return super().on_deactivate(state)

    def on_cleanup(self, state):
        self.release()
        return TransitionCallbackReturn.SUCCESS

    def on_shutdown(self, state):
        if self.frame_timer is not None:
            self.frame_timer.cancel()
        self.release()
        return TransitionCallbackReturn.SUCCESS

    def on_error(self, state):
        self.release()
        self.status_timer = self.create_timer(0.1, self.publish_status)
        return TransitionCallbackReturn.SUCCESS

    def stop(self):
        if self.frame_timer is not None:
            self.destroy_timer(self.frame_timer)
            self.frame_timer = None

    def release(self):
        self.stop()
        if self.image_publisher is not None:
            self.destroy_lifecycle_publisher(self.image_publisher)
            self.image_publisher = None
        if self.camera is not None:
            self.camera.close()
            self.camera = None  # off


def main():
    rclpy.init()
    node = CameraDriver()
    try:
        rclpy.spin(node)
    except (KeyboardInterrupt, ExternalShutdownException):
        pass


main()
