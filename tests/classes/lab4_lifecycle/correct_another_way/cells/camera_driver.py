import contextlib

import rclpy
from camera_hardware import CameraHardware
from rclpy.executors import ExternalShutdownException
from rclpy.lifecycle import Node, TransitionCallbackReturn
from sensor_msgs.msg import Image
from std_msgs.msg import String

SUCCESS, FAILURE, ERROR = (getattr(TransitionCallbackReturn, name) for name in ("SUCCESS", "FAILURE", "ERROR"))


class Life:
    """What a node takes for one life: each thing is put on a stack, and given back from its top."""

    def __init__(self, node, device, fps):
        self.node, self.active = node, False
        self.things = contextlib.ExitStack()
        self.camera = CameraHardware(node, device)
        self.camera.open()
        self.things.callback(self.camera.close)
        self.images = node.create_publisher(Image, "image", 10)
        self.things.callback(node.destroy_publisher, self.images)
        self.things.callback(node.destroy_timer, node.create_timer(1.0 / fps, self.frame))

    def frame(self):
        if self.active:
            image = Image(height=8, width=8, encoding="mono8", step=8)
            image.data = self.camera.read()
            self.images.publish(image)


class CameraDriver(Node):
    def __init__(self):
        super().__init__("camera_driver")
        self.device, self.fps = "/dev/zero", 10.0
        self.declare_parameter("device", self.device)
        self.declare_parameter("fps", self.fps)
        self.life = None
        status = self.create_publisher(String, "status", 10)
        self.create_timer(0.1, lambda: status.publish(String(data="open" if self.life else "closed")))

    def on_configure(self, state):
        with contextlib.suppress(OSError):
            self.life = Life(self, *(self.get_parameter(name).value for name in ("device", "fps")))
            return SUCCESS
        return FAILURE

    def on_activate(self, state):
        try:
            self.life.camera.read()
        except OSError:
            return ERROR
        self.life.active = True
        return SUCCESS

    def on_deactivate(self, state):
        self.life.active = False
        return SUCCESS

    def give_back(self, state):
        if self.life:
            self.life.things.close()
        self.life = None
        return SUCCESS

    on_cleanup = on_shutdown = on_error = give_back


rclpy.init()
with contextlib.suppress(KeyboardInterrupt, ExternalShutdownException):
    rclpy.spin(CameraDriver())
