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
        self.create_subscription(DetectedObjectArray, "detections", self.keep, 10)
        self.create_service(CountObjects, "count_objects", self.count)

    def keep(self, message):
        self.last = message
        self.came = self.get_clock().now()
        self.detected.publish(Int32(data=len(message.objects)))

    def in_box(self, place, low, high):
        return low.x <= place.x <= high.x and low.y <= place.y <= high.y

    def wanted(self, label, labels):
        return not labels or label in labels

    def count(self, request, response):
        response.success = self.last is not None
        if self.last is None:
            response.count = 0
            return response
        if (self.get_clock().now() - self.came).nanoseconds > 2_000_000_000:
            return response  # too old to be true
        hits = [
            one.label
            for one in self.last.objects
            if self.in_box(one.position, request.low, request.high) and self.wanted(one.label, request.labels)
        ]
        response.count = len(hits)
        response.found = sorted(set(hits))
        return response


def main():
    rclpy.init()
    try:
        rclpy.spin(CountServer())
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    rclpy.try_shutdown()


main()
