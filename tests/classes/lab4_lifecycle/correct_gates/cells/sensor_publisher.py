%%node sensor_publisher
import rclpy
from rclpy.lifecycle import Node, State, TransitionCallbackReturn
from std_msgs.msg import String


class SensorPublisher(Node):
    """Timer and publisher live from configure to cleanup; the timer looks whether the publisher is on."""

    def __init__(self, **kwargs):
        super().__init__("sensor_publisher", **kwargs)
        self._period = self.declare_parameter("period", 1.0)
        self._n = None
        self._pub = None
        self._timer = None

    def on_configure(self, state: State) -> TransitionCallbackReturn:
        self._n = 1
        self._pub = self.create_lifecycle_publisher(String, "sensor_data", qos_profile=10)
        self._timer = self.create_timer(self.get_parameter("period").value, self._tick)
        return super().on_configure(state)

    def _tick(self):
        if self._pub is None or not self._pub.is_activated:
            return
        self._pub.publish(String(data="Sensor reading %d" % self._n))
        self._n += 1

    def on_activate(self, state: State) -> TransitionCallbackReturn:
        self._timer.reset()
        return super().on_activate(state)

    def on_cleanup(self, state: State) -> TransitionCallbackReturn:
        self.destroy_timer(self._timer)
        self.destroy_publisher(self._pub)
        self._pub = None
        return super().on_cleanup(state)


def main():
    rclpy.init()
    node = SensorPublisher()
    try:
        rclpy.spin(node)
    except KeyboardInterrupt:
        pass
    finally:
        node.destroy_node()
        rclpy.try_shutdown()


if __name__ == "__main__":
    main()
