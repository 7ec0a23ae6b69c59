import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.lifecycle import LifecycleNode, LifecycleState, TransitionCallbackReturn
from std_msgs.msg import String


class SensorPublisher(LifecycleNode):
    def __init__(self):
        super().__init__("sensor_publisher")
        self.declare_parameter("period", 1.0)
        self.readings = None
        self.ticker = None
        self.count = 0

    def on_configure(self, state: LifecycleState):
        self.count = 0
        first = self.get_namespace().split("/")[1]
        topic = f"/{first}/sensor_data" if first else "/sensor_data"
        self.readings = self.create_lifecycle_publisher(String, topic, 10)
        return TransitionCallbackReturn.SUCCESS

    def on_activate(self, state: LifecycleState):
        if self.ticker is None:
            self.ticker = self.create_timer(self.get_parameter("period").value, self.tick)
        self.ticker.reset()
        return super().on_activate(state)

    def on_deactivate(self, state: LifecycleState):
        self.ticker.cancel()
        return super().on_deactivate(state)

    def on_cleanup(self, state: LifecycleState):
        if self.ticker is not None:
            self.destroy_timer(self.ticker)
            self.destroy_lifecycle_publisher(self.readings)
            self.ticker = None
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
