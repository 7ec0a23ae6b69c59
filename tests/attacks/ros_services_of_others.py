"""Offers the services of the honest node under its very names, and answers nonsense.

Must, beside an honest node: the observer goes on.
"""

import rclpy
from rcl_interfaces.srv import GetParameters, ListParameters
from std_srvs.srv import Trigger


def nonsense(_request, response):
    if hasattr(response, "message"):
        response.message = "\x1b[2J" * 10_000
    return response


rclpy.init()
node = rclpy.create_node("impostor")
node.create_service(Trigger, "/honest/ask", nonsense)
node.create_service(GetParameters, "/honest/get_parameters", nonsense)
node.create_service(ListParameters, "/honest/list_parameters", lambda *_: None)
rclpy.spin(node)
