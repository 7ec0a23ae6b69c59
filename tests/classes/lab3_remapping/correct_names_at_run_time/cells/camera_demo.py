%%node camera_demo
import threading

import rclpy
from rclpy.executors import ExternalShutdownException
from sensor_msgs.msg import Image
from std_msgs.msg import Bool, String

rclpy.init()
node = rclpy.create_node("camera_demo")
name = node.declare_parameter("camera_name", "camera").value
rate = node.declare_parameter("camera_rate", 10).value
frame = node.declare_parameter("camera_frame", "camera_frame").value
images = node.create_publisher(Image, "camera/image_color", 10)
status = node.create_publisher(String, node.get_name() + "/status", 10)
running, stopped = threading.Event(), threading.Event()
node.create_subscription(Bool, "/emergency_stop", lambda msg: stopped.set() if msg.data else stopped.clear(), 10)


def shoot():
    image = Image()
    image.header.frame_id = frame
    while not running.wait(1.0 / rate):
        status.publish(String(data=name))
        if not stopped.is_set():
            images.publish(image)


thread = threading.Thread(target=shoot)
thread.start()
try:
    rclpy.spin(node)
except (KeyboardInterrupt, ExternalShutdownException):
    pass
finally:
    running.set()
    thread.join()
    rclpy.try_shutdown()
