import rclpy
from car_interfaces.srv import CountObjects
from geometry_msgs.msg import Point
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup, ReentrantCallbackGroup
from rclpy.executors import ExternalShutdownException, MultiThreadedExecutor
from rclpy.node import Node
from std_msgs.msg import Bool


class BrakeAssistant(Node):
    def __init__(self):
        super().__init__("brake_assistant")
        self.left = 0
        self.brake = self.create_publisher(Bool, "brake", 10)
        group = MutuallyExclusiveCallbackGroup()
        self.client = self.create_client(CountObjects, "count_objects", callback_group=group)
        self.create_timer(0.2, self.ask, callback_group=ReentrantCallbackGroup())
        self.create_timer(0.2, self.tell, callback_group=MutuallyExclusiveCallbackGroup())

    async def ask(self):
        if not self.client.service_is_ready():
            return
        request = CountObjects.Request()
        request.labels = ["person", "bicycle"]
        request.low, request.high = Point(y=-1.5), Point(x=10.0, y=1.5)
        answer = await self.client.call_async(request)
        self.left = 4 if answer.success and answer.count == 0 else 0

    def tell(self):
        self.left -= 1
        self.brake.publish(Bool(data=self.left < 0))


def main():
    rclpy.init()
    executor = MultiThreadedExecutor(num_threads=3)
    executor.add_node(BrakeAssistant())
    try:
        executor.spin()
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    rclpy.try_shutdown()


main()
