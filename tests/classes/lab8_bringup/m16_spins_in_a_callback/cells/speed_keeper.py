%%node speed_keeper
import time

import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from std_msgs.msg import Float64, Int32


class SpeedKeeper(Node):
    def __init__(self):
        super().__init__("speed_keeper")
        self.declare_parameter("patience", 0.5)
        self.patience = self.get_parameter("patience").value
        self.obstacles = self.scan = None
        self.create_subscription(Int32, "obstacles", self.on_obstacles, 10)
        self.create_subscription(Float64, "scan", self.on_scan, 10)
        self.speed = self.create_publisher(Float64, "speed", 10)
        self.create_timer(0.1, self.tell)

    def on_obstacles(self, msg):
        self.obstacles = time.monotonic()

    def on_scan(self, msg):
        self.scan = time.monotonic()

    def fresh(self, stamp):
        return stamp is not None and time.monotonic() - stamp <= self.patience

    def tell(self):
        if self.fresh(self.obstacles):
            speed = 2.0
        elif self.fresh(self.scan):
            speed = 0.5
        else:
            speed = 0.0
        self.speed.publish(Float64(data=speed))

def main():
    rclpy.init()
    try:
        rclpy.spin(SpeedKeeper())
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    rclpy.try_shutdown()


main()
