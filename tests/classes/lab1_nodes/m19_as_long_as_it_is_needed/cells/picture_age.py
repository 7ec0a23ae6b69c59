%%node picture_age
import rclpy
from rclpy.clock import Clock, ClockType
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from rclpy.time import Time
from sensor_msgs.msg import Image
from std_msgs.msg import Float64


class PictureAge(Node):
    def __init__(self):
        super().__init__("picture_age")
        self.new_data = False
        self.age = 0.0
        self.pub = self.create_publisher(Float64, "age", 10)
        self.sub = self.create_subscription(Image, "camera/image", self.on_image, 10)
        # the main loop: five times as fast as the camera, and independent of the simulated time
        self.loop = self.create_timer(0.1, self.update, clock=Clock(clock_type=ClockType.STEADY_TIME))

    def on_image(self, msg):
        passed = self.get_clock().now() - Time.from_msg(msg.header.stamp, clock_type=self.get_clock().clock_type)
        self.age = passed.nanoseconds * 1e-9
        self.new_data = True

    def update(self):
        if self.new_data:
            self.new_data = False
            self.pub.publish(Float64(data=self.age))


def main():
    rclpy.init()
    try:
        rclpy.spin(PictureAge())
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        rclpy.try_shutdown()


main()
