import functools

import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.lifecycle import LifecycleNode, TransitionCallbackReturn
from std_msgs.msg import String


class Counter:
    """Counts; knows nothing of ROS."""

    __slots__ = ("last",)

    def __init__(self):
        self.last = 0

    def __call__(self):
        self.last += 1
        return self.last


class SensorPublisher(LifecycleNode):
    """One timer for all time, cancelled and reset; the period follows the parameter at each activate."""

    def __init__(self):
        super().__init__("sensor_publisher")
        self.declare_parameter("period", 1.0)
        self.ticker = self.create_timer(1.0, lambda: self.tick(), autostart=False)
        self.tick = lambda: None

    def on_configure(self, state):
        self.output = self.create_lifecycle_publisher(String, "sensor_data", 10)
        self.tick = functools.partial(self.send, Counter())
        return TransitionCallbackReturn.SUCCESS

    def on_activate(self, state):
        self.ticker.timer_period_ns = int(self.get_parameter("period").value * 1e9)
        self.ticker.reset()
        return super().on_activate(state)

    def on_deactivate(self, state):
        self.ticker.cancel()
        return super().on_deactivate(state)

    def on_cleanup(self, state):
        self.destroy_lifecycle_publisher(self.output)
        return TransitionCallbackReturn.SUCCESS

    def send(self, count):
        self.output.publish(String(data=f"Sensor reading {count()}"))


def main():
    rclpy.init()
    try:
        rclpy.spin(SensorPublisher())
    except (KeyboardInterrupt, ExternalShutdownException):
        pass


main()
