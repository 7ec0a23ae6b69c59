"""Offers a parameter service of its own in place of its node's, and answers with a type that does not exist.

Must: no-service.
"""

import rclpy
from rcl_interfaces.msg import ParameterValue
from rcl_interfaces.srv import GetParameters


def answer(_request, response):
    response.values = [ParameterValue(type=99)]
    return response


rclpy.init()
node = rclpy.create_node("talker", start_parameter_services=False)
node.create_service(GetParameters, "/talker/get_parameters", answer)
rclpy.spin(node)
