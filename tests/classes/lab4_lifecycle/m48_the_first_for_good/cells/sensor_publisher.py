%%node sensor_publisher
import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.lifecycle import LifecycleNode, LifecycleState, TransitionCallbackReturn
from std_msgs.msg import String


class SensorPublisher(LifecycleNode):
    def __init__(self):
        super().__init__("sensor_publisher")
        self.declare_parameter("period", 1.0)
        self.made = []
        self.timer = None
        self.count = 0

    def on_configure(self, state: LifecycleState):
        period = self.get_parameter("period").value
        self.count = 0
        self.made.append(self.create_lifecycle_publisher(String, "sensor_data", 10))
        self.timer = self.create_timer(period, self.publish_reading, autostart=False)
        return TransitionCallbackReturn.SUCCESS

    def on_activate(self, state: LifecycleState):
        self.timer.reset()
        return super().on_activate(state)

    def on_deactivate(self, state: LifecycleState):
        self.timer.cancel()
        return super().on_deactivate(state)

    def on_cleanup(self, state: LifecycleState):
        self.destroy_timer(self.timer)
        self.destroy_lifecycle_publisher(self.made[0])
        self.timer = None
        return TransitionCallbackReturn.SUCCESS

    def publish_reading(self):
        self.count += 1
        self.made[-1].publish(String(data=f"Sensor reading {self.count}"))


def main():
    rclpy.init()
    node = SensorPublisher()
    try:
        rclpy.spin(node)
    except (KeyboardInterrupt, ExternalShutdownException):
        pass


main()
