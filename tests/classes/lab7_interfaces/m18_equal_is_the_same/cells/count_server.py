%%node count_server
import rclpy
from car_interfaces.msg import DetectedObjectArray
from car_interfaces.srv import CountObjects
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from std_msgs.msg import Int32


class CountServer(Node):
    def __init__(self):
        super().__init__("count_server")
        self.last = None
        self.detected = self.create_publisher(Int32, "detected", 10)
        self.create_subscription(DetectedObjectArray, "detections", self.on_detections, 10)
        self.create_service(CountObjects, "count_objects", self.count)

    def on_detections(self, message):
        self.last = message
        self.detected.publish(Int32(data=len(message.objects)))

    def count(self, request, response):
        if self.last is None:
            response.success = False
            return response
        low, high = request.low, request.high
        different = {(one.label, one.position.x, one.position.y) for one in self.last.objects}
        counted = [
            label
            for label, x, y in different
            if low.x <= x <= high.x and low.y <= y <= high.y and (not request.labels or label in request.labels)
        ]
        response.success = True
        response.count = len(counted)
        response.found = sorted(set(counted))
        return response


def main():
    rclpy.init()
    try:
        rclpy.spin(CountServer())
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    rclpy.try_shutdown()


main()
