%%node obstacle_counter
import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.lifecycle import LifecycleNode, TransitionCallbackReturn
from std_msgs.msg import Float64, Int32


class ObstacleCounter(LifecycleNode):
    def __init__(self):
        super().__init__("counter")
        self.declare_parameter("limit", 1.0)
        self.active = False

    def on_configure(self, state):
        self.count = 0
        self.publisher = self.create_lifecycle_publisher(Int32, "obstacles", 10)
        self.subscription = self.create_subscription(Float64, "distance", self.on_distance, 10)
        return TransitionCallbackReturn.SUCCESS

    def on_activate(self, state):
        self.active = True
        return super().on_activate(state)

    def on_deactivate(self, state):
        self.active = False
        return super().on_deactivate(state)

    def on_cleanup(self, state):
        self.destroy_subscription(self.subscription)
        self.destroy_lifecycle_publisher(self.publisher)
        return TransitionCallbackReturn.SUCCESS

    def on_distance(self, msg):
        if not self.active:
            return
        if msg.data < self.get_parameter("limit").value:
            self.count += 1
            self.publisher.publish(Int32(data=self.count))


def main():
    rclpy.init()
    node = ObstacleCounter()
    try:
        rclpy.spin(node)
    except (KeyboardInterrupt, ExternalShutdownException):
        pass


main()
