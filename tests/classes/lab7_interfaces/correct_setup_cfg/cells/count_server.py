import threading

import rclpy
from car_interfaces.msg import DetectedObjectArray
from car_interfaces.srv import CountObjects
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.executors import ExternalShutdownException, MultiThreadedExecutor
from rclpy.node import Node
from std_msgs.msg import Int32


class CountServer(Node):
    def __init__(self):
        super().__init__("count_server")
        group = ReentrantCallbackGroup()
        self.lock, self.objects, self.any = threading.Lock(), [], False
        self.detected = self.create_publisher(Int32, "detected", 10)
        self.create_subscription(DetectedObjectArray, "detections", self.on_detections, 10, callback_group=group)
        self.create_service(CountObjects, "count_objects", self.count, callback_group=group)

    def on_detections(self, message):
        with self.lock:
            self.objects, self.any = list(message.objects), True
        self.detected.publish(Int32(data=len(message.objects)))

    def count(self, request, response):
        with self.lock:
            objects, response.success = self.objects, self.any
        found = {}
        for one in objects:
            if request.labels and one.label not in request.labels:
                continue
            if not request.low.x <= one.position.x <= request.high.x:
                continue
            if not request.low.y <= one.position.y <= request.high.y:
                continue
            found[one.label] = found.get(one.label, 0) + 1
        response.count = sum(found.values())
        response.found = sorted(found, reverse=True)
        return response


def main():
    rclpy.init()
    executor = MultiThreadedExecutor(num_threads=2)
    executor.add_node(CountServer())
    try:
        executor.spin()
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    rclpy.try_shutdown()


main()
