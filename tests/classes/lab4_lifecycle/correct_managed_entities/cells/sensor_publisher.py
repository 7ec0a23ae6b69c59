%%node sensor_publisher
import rclpy
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.lifecycle import LifecycleNode, ManagedEntity, TransitionCallbackReturn
from std_msgs.msg import String


class ManagedTimer(ManagedEntity):
    """A timer that is managed after all: the node's own callbacks need not know it."""

    def __init__(self, node, callback):
        self.node, self.callback, self.timer = node, callback, None

    def on_activate(self, state):
        self.timer = self.node.create_timer(self.node.get_parameter("period").value, self.callback)
        return TransitionCallbackReturn.SUCCESS

    def on_deactivate(self, state):
        self.node.destroy_timer(self.timer)
        return TransitionCallbackReturn.SUCCESS


class SensorPublisher(LifecycleNode):
    def __init__(self):
        super().__init__("sensor_publisher")
        self.declare_parameter("period", 1.0)
        self.add_managed_entity(ManagedTimer(self, self.publish_reading))

    def on_configure(self, state):
        self.numbers = iter(range(1, 1_000_000))
        self.publisher = self.create_lifecycle_publisher(String, "sensor_data", 10)
        return super().on_configure(state)

    def on_cleanup(self, state):
        self.destroy_lifecycle_publisher(self.publisher)
        return super().on_cleanup(state)

    def publish_reading(self):
        if self.publisher.is_activated:
            self.publisher.publish(String(data=f"Sensor reading {next(self.numbers)}"))


rclpy.init()
executor = SingleThreadedExecutor()
executor.add_node(SensorPublisher())
try:
    executor.spin()
except (KeyboardInterrupt, ExternalShutdownException):
    pass
