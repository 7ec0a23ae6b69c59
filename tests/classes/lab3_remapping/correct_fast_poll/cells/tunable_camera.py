%%node tunable_camera
import time

import rclpy
from rcl_interfaces.msg import SetParametersResult
from rclpy.executors import ExternalShutdownException
from sensor_msgs.msg import Image


def validate(parameters):
    bad = [p for p in parameters if p.name == "camera_rate" and (p.value < 1 or p.value > 60)]
    return SetParametersResult(successful=not bad, reason="out of range 1..60" if bad else "")


rclpy.init()
node = rclpy.create_node("tunable_camera")
node.declare_parameter("camera_rate", 10)
node.declare_parameter("camera_frame", "camera_frame")
node.add_on_set_parameters_callback(validate)
images = node.create_publisher(Image, "image", 10)
following = time.monotonic()
try:
    while rclpy.ok():
        rclpy.spin_once(node, timeout_sec=max(0.0, following - time.monotonic()))
        if time.monotonic() >= following:
            following += 1.0 / node.get_parameter("camera_rate").value
            image = Image()
            image.header.frame_id = node.get_parameter("camera_frame").value
            images.publish(image)
except (KeyboardInterrupt, ExternalShutdownException):
    pass
finally:
    rclpy.try_shutdown()
