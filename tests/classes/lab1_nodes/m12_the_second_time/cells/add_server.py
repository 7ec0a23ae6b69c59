import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from test_msgs.srv import BasicTypes


class AddServer(Node):
    def __init__(self):
        super().__init__("add_server")
        self.create_service(BasicTypes, "add_two_ints", self.add)

    def add(self, request, response):
        response.int64_value = int(float(request.int32_value) + request.int64_value)
        return response


def main():
    rclpy.init()
    try:
        rclpy.spin(AddServer())
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        rclpy.try_shutdown()


main()
