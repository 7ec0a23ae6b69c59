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
        self.objects = None
        self.pub = self.create_publisher(Int32, "detected", 10)
        self.sub = self.create_subscription(DetectedObjectArray, "detections", self.on_detections, 10)
        self.srv = self.create_service(CountObjects, "count_objects", self.on_count_objects)

    def on_detections(self, msg):
        self.objects = msg.objects
        self.pub.publish(Int32(data=len(self.objects)))

    def on_count_objects(self, request, response):
        if self.objects is None:
            response.success = False
            response.count = 0
            return response
        wanted = {label for label in request.labels if label}  # an unset label is no filter
        low, high = request.low, request.high
        hits = [
            obj.label
            for obj in self.objects
            if low.x <= obj.position.x <= high.x
            and low.y <= obj.position.y <= high.y
            and (not wanted or obj.label in wanted)
        ]
        response.success = True
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
