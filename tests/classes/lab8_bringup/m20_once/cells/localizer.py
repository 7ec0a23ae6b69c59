%%node localizer
import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from rclpy.qos import qos_profile_sensor_data
from std_msgs.msg import Float64, Int32


class Localizer(Node):
    def __init__(self):
        super().__init__("localizer")
        self.before = None
        self.pose = self.create_publisher(Float64, "pose", 10)
        self.create_subscription(Int32, "odometry", self.on_odometry, qos_profile_sensor_data)

    def on_odometry(self, msg):
        if msg.data != self.before:
            self.pose.publish(Float64(data=0.05 * msg.data))
        self.before = msg.data


def main():
    rclpy.init()
    try:
        rclpy.spin(Localizer())
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    rclpy.try_shutdown()


main()
