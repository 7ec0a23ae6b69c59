%%node map_viewer
import rclpy
from nav_msgs.msg import OccupancyGrid
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from std_msgs.msg import Int32


class MapViewer(Node):
    def __init__(self):
        super().__init__("map_viewer")
        self.width = None
        self.publisher = self.create_publisher(Int32, "map_width", 10)
        self.create_timer(0.1, lambda: self.width is not None and self.publisher.publish(Int32(data=self.width)))
        latched = QoSProfile(
            depth=1, reliability=ReliabilityPolicy.RELIABLE, durability=DurabilityPolicy.TRANSIENT_LOCAL
        )
        self.create_subscription(OccupancyGrid, "map", self.show, latched)

    def show(self, grid):
        self.width = grid.info.width


def main():
    rclpy.init()
    try:
        rclpy.spin(MapViewer())
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    rclpy.try_shutdown()


main()
