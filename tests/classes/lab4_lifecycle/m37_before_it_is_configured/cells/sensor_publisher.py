import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.lifecycle import LifecycleNode, LifecycleState, TransitionCallbackReturn
from std_msgs.msg import String


class SensorPublisher(LifecycleNode):
    def __init__(self):
        super().__init__("sensor_publisher")
        self.period = self.declare_parameter("period", 1.0).value
        self.readings = self.create_lifecycle_publisher(String, "sensor_data", 10)
        self.ticker = None
        self.count = 0

    def on_configure(self, state: LifecycleState):
        self.count = 0
        if self.readings is None:  # a cleanup took it away
            self.readings = self.create_lifecycle_publisher(String, "sensor_data", 10)
        if self.period is None:
            self.period = self.get_parameter("period").value
        self.ticker = self.create_timer(self.period, self.tick, autostart=False)
        return TransitionCallbackReturn.SUCCESS

    def on_activate(self, state: LifecycleState):
        self.ticker.reset()
        return super().on_activate(state)

    def on_deactivate(self, state: LifecycleState):
        self.ticker.cancel()
        return super().on_deactivate(state)

    def on_cleanup(self, state: LifecycleState):
        self.destroy_timer(self.ticker)
        self.destroy_lifecycle_publisher(self.readings)
        self.readings = None
        self.period = None  # somebody may set another one now
        return TransitionCallbackReturn.SUCCESS

    def tick(self):
        self.count += 1
        self.readings.publish(String(data=f"Sensor reading {self.count}"))


def main():
    rclpy.init()
    node = SensorPublisher()
    try:
        rclpy.spin(node)
    except (KeyboardInterrupt, ExternalShutdownException):
        pass


main()
