%%node camera_driver
import rclpy
from camera_hardware import CameraHardware
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.lifecycle import LifecycleNode, TransitionCallbackReturn
from sensor_msgs.msg import Image
from std_msgs.msg import String

OK, NO, BROKEN = TransitionCallbackReturn.SUCCESS, TransitionCallbackReturn.FAILURE, TransitionCallbackReturn.ERROR


class CameraDriver(LifecycleNode):
    """Everything is made in on_configure; the image timer is stopped and started."""

    def __init__(self):
        super().__init__("camera_driver")
        self.declare_parameters("", [("device", "/dev/zero"), ("fps", 10.0)])
        self._hw = self._images = self._timer = None
        self._status = self.create_publisher(String, "status", 1)
        self.create_timer(0.1, lambda: self._status.publish(String(data="open" if self._hw else "closed")))

    def on_configure(self, _):
        hw = CameraHardware(self, self.get_parameter("device").value)
        try:
            hw.open()
        except OSError:
            return NO
        self._hw = hw
        self._images = self.create_lifecycle_publisher(Image, "image", rclpy.qos.qos_profile_sensor_data)
        self._timer = self.create_timer(1 / self.get_parameter("fps").value, self._send)
        self._timer.cancel()
        return OK

    def on_activate(self, state):
        try:
            self._hw.read()
        except OSError:
            return BROKEN
        self._timer.reset()
        return super().on_activate(state)

    def on_deactivate(self, state):
        self._timer.cancel()
        return super().on_deactivate(state)

    def on_cleanup(self, state):
        if self._timer:
            self._timer.cancel()
            self.destroy_timer(self._timer)
            self.destroy_lifecycle_publisher(self._images)
            self._hw.close()
        self._hw = self._images = self._timer = None
        return OK

    on_shutdown = on_error = on_cleanup

    def _send(self):
        if self._images and self._images.is_activated:
            self._images.publish(Image(width=8, height=8, step=8, encoding="mono8", data=self._hw.read()))


rclpy.init()
executor = SingleThreadedExecutor()
executor.add_node(CameraDriver())
try:
    executor.spin()
except (KeyboardInterrupt, ExternalShutdownException):
    pass
