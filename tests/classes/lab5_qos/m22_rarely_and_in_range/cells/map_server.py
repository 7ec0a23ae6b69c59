%%node map_server
import rclpy
from nav_msgs.msg import OccupancyGrid
from rclpy.duration import Duration
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy


class MapServer(Node):
    def __init__(self):
        super().__init__("map_server")
        width = self.declare_parameter("width", 4).value
        grid = OccupancyGrid()
        grid.info.width = grid.info.height = width
        grid.data = [0] * width * width
        latched = QoSProfile(
            depth=1, reliability=ReliabilityPolicy.RELIABLE, durability=DurabilityPolicy.TRANSIENT_LOCAL,
            lifespan=Duration(seconds=60.0),
        )
        self.publisher = self.create_publisher(OccupancyGrid, "map", latched)
        self.publisher.publish(grid)


def main():
    rclpy.init()
    try:
        rclpy.spin(MapServer())
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    rclpy.try_shutdown()


main()
