%%node sensor_publisher
import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.lifecycle import LifecycleNode, TransitionCallbackReturn as Outcome
from std_msgs.msg import String


class SensorPublisher(LifecycleNode):
    """An ordinary publisher is enough: nothing calls it unless the node is active."""

    def __init__(self):
        super().__init__("sensor_publisher")
        self.declare_parameter("period", 1.0)

    def on_configure(self, state):
        self.next_number = 1
        self.data_publisher = self.create_publisher(String, "sensor_data", 10)
        return Outcome.SUCCESS

    def on_activate(self, state):
        self.data_timer = self.create_timer(self.get_parameter("period").get_parameter_value().double_value, self.send)
        return Outcome.SUCCESS

    def on_deactivate(self, state):
        self.data_timer.destroy()
        return Outcome.SUCCESS

    def on_cleanup(self, state):
        self.destroy_publisher(self.data_publisher)
        return Outcome.SUCCESS

    def on_shutdown(self, state):
        if state.label == "active":
            self.on_deactivate(state)
        if state.label in ("active", "inactive"):
            self.on_cleanup(state)
        return Outcome.SUCCESS

    def send(self):
        message = String()
        message.data = "Sensor reading " + str(self.next_number)
        self.data_publisher.publish(message)
        self.next_number += 1


def main(args=None):
    rclpy.init(args=args)
    try:
        rclpy.spin(SensorPublisher())
    except (KeyboardInterrupt, ExternalShutdownException):
        pass


if __name__ == "__main__":
    main()
