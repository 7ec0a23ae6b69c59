%%node sensor_publisher
import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.lifecycle import LifecycleNode, LifecycleState, TransitionCallbackReturn
from std_msgs.msg import String


class SensorPublisher(LifecycleNode):
    def __init__(self):
        super().__init__("sensor_publisher")
        self.declare_parameter("period", 1.0)
        self.publisher = None
        self.timer = None
        self.count = 0
        self.greeted = False

    def on_configure(self, state: LifecycleState) -> TransitionCallbackReturn:
        self.count = 0
        self.publisher = self.create_publisher(String, "sensor_data", 10)
        if not self.greeted:
            self.greeted = True
            self.publish_reading()
        return TransitionCallbackReturn.SUCCESS

    def on_activate(self, state: LifecycleState) -> TransitionCallbackReturn:
        self.timer = self.create_timer(self.get_parameter("period").value, self.publish_reading)
        return super().on_activate(state)

    def on_deactivate(self, state: LifecycleState) -> TransitionCallbackReturn:
        self.destroy_timer(self.timer)
        return super().on_deactivate(state)

    def on_cleanup(self, state: LifecycleState) -> TransitionCallbackReturn:
        self.destroy_publisher(self.publisher)
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
