%%node camera_demo
import functools

import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.qos import qos_profile_sensor_data
from sensor_msgs.msg import Image
from std_msgs.msg import Bool, String


def obey(state, msg):
    state["stopped"] = msg.data


def shoot(node, state, images, status):
    status.publish(String(data=node.get_parameter("camera_name").get_parameter_value().string_value))
    if state["stopped"]:
        return
    image = Image()
    image.header.frame_id = node.get_parameter("camera_frame").get_parameter_value().string_value
    images.publish(image)


def camera():
    node, state = rclpy.create_node("camera_demo"), {"stopped": False}
    node.declare_parameters("", [("camera_name", "camera"), ("camera_rate", 10), ("camera_frame", "camera_frame")])
    images = node.create_publisher(Image, topic="camera/image_color", qos_profile=1)
    status = node.create_publisher(String, "~/status", 100)
    node.create_subscription(Bool, "/emergency_stop", functools.partial(obey, state), qos_profile_sensor_data)
    node.create_timer(1 / node.get_parameter("camera_rate").value, functools.partial(shoot, node, state, images, status))
    return node


if __name__ == "__main__":
    rclpy.init()
    try:
        rclpy.spin(camera())
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    rclpy.try_shutdown()
