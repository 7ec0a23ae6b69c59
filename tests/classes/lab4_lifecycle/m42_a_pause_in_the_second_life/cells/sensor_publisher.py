%%node sensor_publisher
import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.lifecycle import LifecycleNode, LifecycleState, TransitionCallbackReturn
from std_msgs.msg import String


class SensorPublisher(LifecycleNode):
    def __init__(self):
        super().__init__("sensor_publisher")
        self.declare_parameter("period", 1.0)
        self.count = 0
        self.cleaned_up = False

    def on_configure(self, state: LifecycleState):
        self.publisher = self.create_lifecycle_publisher(String, "sensor_data", 10)
        return TransitionCallbackReturn.SUCCESS

    def on_activate(self, state: LifecycleState):
        if self.cleaned_up:  # this is a new life
            self.count = 0
        self.timer = self.create_timer(self.get_parameter("period").value, self.publish_reading)
        return super().on_activate(state)

    def on_deactivate(self, state: LifecycleState):
        self.destroy_timer(self.timer)
        return super().on_deactivate(state)

    def on_cleanup(self, state: LifecycleState):
        self.cleaned_up = True
        self.destroy_lifecycle_publisher(self.publisher)
        return TransitionCallbackReturn.SUCCESS

    def publish_reading(self):
        self.count += 1
        self.publisher.publish(String(data=f"Sensor reading {self.count}"))


def main():
    rclpy.init()
    node = SensorPublisher()
    try:
        rclpy.spin(node)
    except (KeyboardInterrupt, ExternalShutdownException):
        pass


main()
