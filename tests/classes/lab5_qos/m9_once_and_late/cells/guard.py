import rclpy
from rclpy.duration import Duration
from rclpy.event_handler import SubscriptionEventCallbacks
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from rclpy.qos import LivelinessPolicy, QoSProfile
from std_msgs.msg import Int32, String


class Guard(Node):
    def __init__(self):
        super().__init__("guard")
        self.state = "waiting"
        self.publisher = self.create_publisher(String, "controller_state", 10)
        self.create_timer(0.1, lambda: self.publisher.publish(String(data=self.state)))
        requested = QoSProfile(
            depth=1, liveliness=LivelinessPolicy.MANUAL_BY_TOPIC, liveliness_lease_duration=Duration(seconds=0.4)
        )
        events = SubscriptionEventCallbacks(liveliness=self.changed)
        self.create_subscription(Int32, "steering", lambda _: None, requested, event_callbacks=events)

    def changed(self, event):
        if event.alive_count > 0: self.state = "alive"
        elif not getattr(self,"once",False):
            self.once=True; self.state="lost"


def main():
    rclpy.init()
    try:
        rclpy.spin(Guard())
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    rclpy.try_shutdown()


main()
