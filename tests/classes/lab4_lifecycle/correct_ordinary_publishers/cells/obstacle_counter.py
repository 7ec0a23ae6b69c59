%%node obstacle_counter
import rclpy
from rclpy.lifecycle import LifecycleNode, TransitionCallbackReturn
from std_msgs.msg import Float64, Int32


class ObstacleCounter(LifecycleNode):
    """The callback is a function that changes with the state."""

    def __init__(self):
        super().__init__("obstacle_counter")
        self.declare_parameter("limit", 1.0)
        self.react = self.ignore

    def ignore(self, distance):
        pass

    def count_it(self, distance):
        if distance.data < self.limit:
            self.obstacles += 1
            self.out.publish(Int32(data=self.obstacles))

    def on_configure(self, previous):
        self.limit = self.get_parameter("limit").value
        self.obstacles = 0
        self.out = self.create_publisher(Int32, "obstacles", 10)
        self.inp = self.create_subscription(Float64, "distance", lambda m: self.react(m), 10)
        return TransitionCallbackReturn.SUCCESS

    def on_activate(self, previous):
        self.react = self.count_it
        return TransitionCallbackReturn.SUCCESS

    def on_deactivate(self, previous):
        self.react = self.ignore
        return TransitionCallbackReturn.SUCCESS

    def on_cleanup(self, previous):
        self.destroy_subscription(self.inp)
        self.destroy_publisher(self.out)
        return TransitionCallbackReturn.SUCCESS


rclpy.init()
node = ObstacleCounter()
while rclpy.ok():
    rclpy.spin_once(node, timeout_sec=0.1)
