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
        self.timer = None
        self.configured = False
        self.status_pub = self.create_publisher(String, "status", 10)
        self.status_timer = self.create_timer(0.1, self.on_status_timer)

    # transitions

    def on_configure(self, state):
        camera = CameraHardware(self, self.get_parameter("device").value)
        try:
            camera.open()
        except OSError as error:
            self.get_logger().warning("cannot open: %s" % error)
            return TransitionCallbackReturn.FAILURE
        self.camera = camera
        self.configured = True
        self.image_pub = self.create_lifecycle_publisher(Image, "image", 10)
        return TransitionCallbackReturn.SUCCESS

    def on_activate(self, state):
        try:
            self.camera.read()
        except OSError as error:
            self.get_logger().error("broken: %s" % error)
            return TransitionCallbackReturn.ERROR
        self.timer = self.create_timer(1.0 / self.get_parameter("fps").value, self.on_timer)
        return super().on_activate(state)

    def on_deactivate(self, state):
        self.stop_timer()
        return super().on_deactivate(state)

    def on_cleanup(self, state):
        self.power_off()
        self.remove_publisher()
        self.configured = False
        return TransitionCallbackReturn.SUCCESS

    def on_shutdown(self, state):
        self.stop_timer()
        if self.configured:
            self.camera.close()
            self.camera = None
            self.destroy_lifecycle_publisher(self.image_pub)
            self.image_pub = None
            self.configured = False
        return TransitionCallbackReturn.SUCCESS

    def on_error(self, state):
        self.stop_timer()
        self.power_off()
        self.remove_publisher()
        return TransitionCallbackReturn.SUCCESS

    # helpers

    def stop_timer(self):
        if self.timer is not None:
            self.destroy_timer(self.timer)
            self.timer = None

    def power_off(self):
        if self.camera is not None:
            self.camera.close()
            self.camera = None

    def remove_publisher(self):
        if self.image_pub is not None:
            self.destroy_lifecycle_publisher(self.image_pub)
            self.image_pub = None

    # callbacks

    def on_timer(self):
        msg = Image()
        msg.header.stamp = self.get_clock().now().to_msg()
        msg.height = 8
        msg.width = 8
        msg.encoding = "mono8"
        msg.step = 8
        msg.data = self.camera.read()
        self.image_pub.publish(msg)

    def on_status_timer(self):
        self.status_pub.publish(String(data="closed" if self.camera is None else "open"))


def main():
    rclpy.init()
    node = CameraDriver()
    try:
        rclpy.spin(node)
    except (KeyboardInterrupt, ExternalShutdownException):
        pass


main()
