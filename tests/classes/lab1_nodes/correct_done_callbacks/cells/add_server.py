%%node add_server
import rclpy
from rclpy.executors import ExternalShutdownException
from test_msgs.srv import BasicTypes


def add(request, response):
    return BasicTypes.Response(int64_value=request.int32_value + request.int64_value)


rclpy.init()
node = rclpy.create_node("add_server")
service = node.create_service(BasicTypes, "add_two_ints", add)
try:
    rclpy.spin(node)
except (KeyboardInterrupt, ExternalShutdownException):
    pass
