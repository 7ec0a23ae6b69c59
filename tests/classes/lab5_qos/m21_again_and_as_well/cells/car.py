%%node car
import rclpy
from geometry_msgs.msg import Twist
from nav_msgs.msg import OccupancyGrid
from rclpy.duration import Duration
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import Image, PointCloud2
from std_msgs.msg import Bool


class Car(Node):
    def __init__(self):
        super().__init__("car")
        camera = QoSProfile(depth=5, reliability=ReliabilityPolicy.BEST_EFFORT, deadline=Duration(seconds=0.05))
        lidar = QoSProfile(depth=5, reliability=ReliabilityPolicy.BEST_EFFORT)
        control = QoSProfile(depth=1, reliability=ReliabilityPolicy.RELIABLE, lifespan=Duration(seconds=0.2))
        latched = QoSProfile(
            depth=1, reliability=ReliabilityPolicy.RELIABLE, durability=DurabilityPolicy.TRANSIENT_LOCAL,
            lifespan=Duration(seconds=60.0),
        )
        self.camera = self.create_publisher(Image, "camera/image", camera)
        self.lidar = self.create_publisher(PointCloud2, "lidar/points", lidar)
        self.control = self.create_publisher(Twist, "control/command", control)
        self.map = self.create_publisher(OccupancyGrid, "map", latched)
        self.stop = self.create_publisher(Bool, "emergency_stop", latched)
        self.create_timer(1 / 30, lambda: self.camera.publish(Image()))
        self.create_timer(0.1, lambda: self.lidar.publish(PointCloud2()))
        self.create_timer(0.05, lambda: self.control.publish(Twist()))
        self.map.publish(OccupancyGrid())
        self.stop.publish(Bool(data=False))


def main():
    rclpy.init()
    try:
        rclpy.spin(Car())
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    rclpy.try_shutdown()


main()
