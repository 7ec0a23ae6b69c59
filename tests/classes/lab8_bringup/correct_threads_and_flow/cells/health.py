%%node health
from functools import partial

import rclpy
from rclpy.duration import Duration
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from rclpy.qos import qos_profile_sensor_data
from std_msgs.msg import Int32, String


class Watched:
    __slots__ = ("name", "heard")

    def __init__(self, name):
        self.name, self.heard = name, None


class Health(Node):
    def __init__(self):
        super().__init__("health")
        names = self.declare_parameter("topics", ["scan"]).value
        self.silence = Duration(seconds=self.declare_parameter("silence", 1.0).value)
        self.watched = [Watched(name) for name in names]
        self.subs = [
            self.create_subscription(Int32, one.name, partial(self.note, one), qos_profile_sensor_data)
            for one in self.watched
        ]
        self.told = self.create_publisher(String, "health", 1)
        self.create_timer(1 / 5, self.report)

    def note(self, one, msg):
        one.heard = self.get_clock().now()

    def report(self):
        now = self.get_clock().now()
        silent = [one.name for one in self.watched if one.heard is None or now - one.heard > self.silence]
        self.told.publish(String(data=" ".join(silent) if silent else "ok"))


def main():
    rclpy.init()
    try:
        rclpy.spin(Health())
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    rclpy.try_shutdown()


main()
