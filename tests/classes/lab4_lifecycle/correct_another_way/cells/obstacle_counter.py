import threading

import rclpy
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.executors import ExternalShutdownException, MultiThreadedExecutor
from rclpy.lifecycle import LifecycleNode, TransitionCallbackReturn
from std_msgs.msg import Float64, Int32


class ObstacleCounter(LifecycleNode):
    """Several threads and a lock; the limit is kept by a callback of the parameter."""

    def __init__(self):
        super().__init__("obstacle_counter")
        self.limit = self.declare_parameter("limit", 1.0).value
        self.add_post_set_parameters_callback(self.limit_changed)
        self.lock = threading.Lock()
        self.counting = False

    def limit_changed(self, parameters):
        self.limit = next((p.value for p in parameters if p.name == "limit"), self.limit)

    def on_configure(self, state):
        self.count = 0
        self.output = self.create_publisher(Int32, "obstacles", 10)
        self.input = self.create_subscription(
            Float64, "distance", self.heard, 10, callback_group=ReentrantCallbackGroup()
        )
        return TransitionCallbackReturn.SUCCESS

    def switch(self, on):
        with self.lock:
            self.counting = on
        return TransitionCallbackReturn.SUCCESS

    def on_activate(self, state):
        return self.switch(True)

    def on_deactivate(self, state):
        return self.switch(False)

    def on_cleanup(self, state):
        self.destroy_subscription(self.input)
        self.destroy_publisher(self.output)
        return TransitionCallbackReturn.SUCCESS

    def heard(self, message):
        with self.lock:
            if self.counting and message.data < self.limit:
                self.count += 1
                self.output.publish(Int32(data=self.count))


def main():
    rclpy.init()
    executor = MultiThreadedExecutor(num_threads=3)
    executor.add_node(ObstacleCounter())
    try:
        executor.spin()
    except (KeyboardInterrupt, ExternalShutdownException):
        pass


if __name__ == "__main__":
    main()
