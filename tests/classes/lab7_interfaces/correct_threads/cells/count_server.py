%%node count_server
import rclpy
from car_interfaces.msg import DetectedObjectArray
from car_interfaces.srv import CountObjects
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from std_msgs.msg import Int32
import itertools


class CountServer(Node):
    objects: list

    def __init__(self):
        super().__init__("count_server")
        self.out = self.create_publisher(Int32, "detected", 10)
        self.create_subscription(DetectedObjectArray, "detections", lambda m: (self.keep(m), self.tell()), 10)
        self.create_service(CountObjects, "count_objects", self.answer)

    def keep(self, message):
        self.objects = [(o.label, o.position.x, o.position.y) for o in message.objects]

    def tell(self):
        self.out.publish(Int32(data=len(self.objects)))

    def answer(self, request, response):
        try:
            objects = self.objects
        except AttributeError:
            self.get_logger().warning("nothing was detected yet")
            response.success, response.count = False, 0
            return response
        labels = []
        for label, x, y in objects:
            match label:
                case _ if request.labels and label not in request.labels:
                    continue
            if max(request.low.x, min(x, request.high.x)) != x:
                continue
            if max(request.low.y, min(y, request.high.y)) != y:
                continue
            labels.append(label)
        response.success, response.count = True, len(labels)
        response.found = [label for label, _ in itertools.groupby(sorted(labels))]
        return response


def main():
    rclpy.init()
    node = CountServer()
    try:
        while rclpy.ok():
            rclpy.spin_once(node, timeout_sec=1.0)
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        node.destroy_node()
        rclpy.try_shutdown()


main()
