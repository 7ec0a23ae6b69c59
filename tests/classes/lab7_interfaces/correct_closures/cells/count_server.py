%%node count_server
import rclpy
from car_interfaces.msg import DetectedObjectArray
from car_interfaces.srv import CountObjects
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from std_msgs.msg import Int32
import threading

from rclpy.callback_groups import MutuallyExclusiveCallbackGroup
from rclpy.executors import MultiThreadedExecutor


class CountServer(Node):
    def __init__(self):
        super().__init__("count_server")
        self._lock = threading.Lock()
        self._last = None
        self.create_service(CountObjects, "count_objects", self.count, callback_group=MutuallyExclusiveCallbackGroup())
        self.sub = self.create_subscription(DetectedObjectArray, "detections", self.listen, 10)
        self.pub = self.create_publisher(Int32, "detected", 10)

    def listen(self, message):
        with self._lock:
            self._last = message
        self.pub.publish(Int32(data=len(message.objects)))

    async def count(self, request, response):
        with self._lock:
            last = self._last
        if last is None:
            response.success = False
            return response
        wanted = set(request.labels) or {o.label for o in last.objects}
        hits = list(filter(lambda o: o.label in wanted and self.lies_in(o.position, request.low, request.high), last.objects))
        response.success = True
        response.count = len(hits)
        response.found = {o.label for o in hits}
        self.get_logger().info(f"{response.count} gezählt")
        return response

    @staticmethod
    def lies_in(p, low, high):
        return not (p.x < low.x or p.x > high.x or p.y < low.y or high.y < p.y)


def main():
    rclpy.init()
    executor = MultiThreadedExecutor()
    executor.add_node(CountServer())
    try:
        executor.spin()
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    rclpy.try_shutdown()


main()
