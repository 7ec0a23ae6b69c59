%%node brake_assistant
import rclpy
from car_interfaces.srv import CountObjects
from geometry_msgs.msg import Point
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from std_msgs.msg import Bool


class BrakeAssistant(Node):
    def __init__(self):
        super().__init__("brake_assistant")
        self.free_since = None
        self.brake = self.create_publisher(Bool, "brake", 10)
        self.client = self.create_client(CountObjects, "count_objects")
        self.client.wait_for_service()
        self.create_timer(0.2, self.ask)

    def ask(self):
        known = self.free_since is not None
        free = known and (self.get_clock().now() - self.free_since).nanoseconds < 3e9
        self.brake.publish(Bool(data=not free))
        if self.client.service_is_ready():
            box = {"low": Point(x=0.0, y=-1.5), "high": Point(x=10.0, y=1.5)}
            request = CountObjects.Request(labels=["person", "bicycle"], **box)
            self.client.call_async(request).add_done_callback(self.on_answer)

    def on_answer(self, future):
        answer = future.result()
        free = answer.success and answer.count == 0
        self.free_since = self.get_clock().now()


def main():
    rclpy.init()
    try:
        rclpy.spin(BrakeAssistant())
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    rclpy.try_shutdown()


main()
