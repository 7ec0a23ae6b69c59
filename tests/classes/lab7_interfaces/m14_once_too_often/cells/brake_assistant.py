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
        self.client = self.create_client(CountObjects, "count_objects")
        self.publisher = self.create_publisher(Bool, "brake", 10)
        self.request = CountObjects.Request(
            labels=["person", "bicycle"], low=Point(x=0.0, y=-1.5), high=Point(x=10.0, y=1.5)
        )
        self.free = False
        self.time = None
        self.create_timer(0.2, self.tick)

    def publish(self):
        fresh = self.time is not None and (self.get_clock().now() - self.time).nanoseconds < 1e9
        self.publisher.publish(Bool(data=not (fresh and self.free)))

    def tick(self):
        self.publish()
        if self.client.service_is_ready():
            self.client.call_async(self.request).add_done_callback(self.on_answer)

    def on_answer(self, future):
        answer = future.result()
        self.free = answer.success and answer.count == 0
        self.time = self.get_clock().now()
        self.publish()  # as early as possible


def main():
    rclpy.init()
    try:
        rclpy.spin(BrakeAssistant())
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    rclpy.try_shutdown()


main()
