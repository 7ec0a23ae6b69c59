import threading

import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from std_msgs.msg import Float64
from std_srvs.srv import SetBool


def start():
    rclpy.init()
    node = Node("speed_sensor", parameter_overrides=[])
    node.declare_parameter("speed", 5.0)
    going = threading.Event()
    going.set()
    out = node.create_publisher(Float64, "speed", 10)

    def switch(request, response):
        (going.set if request.data else going.clear)()
        response.success, response.message = True, "done"
        return response

    def tick():
        message = Float64()
        message.data = node.get_parameter("speed").get_parameter_value().double_value
        if going.is_set():
            out.publish(message)

    node.create_service(SetBool, "enable", switch)
    node.create_timer(0.1, tick)
    try:
        rclpy.spin(node)
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        node.destroy_node()
        rclpy.try_shutdown()
