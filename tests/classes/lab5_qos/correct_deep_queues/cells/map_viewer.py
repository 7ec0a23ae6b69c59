%%node map_viewer
import rclpy
from nav_msgs.msg import OccupancyGrid
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from std_msgs.msg import Int32


class MapViewer(Node):
    def __init__(self):
        super().__init__("map_viewer")
        self.grid = OccupancyGrid()
        self.width = self.create_publisher(Int32, "map_width", 1)
        self.create_subscription(
            OccupancyGrid, "map", lambda grid: setattr(self, "grid", grid),
            QoSProfile(depth=3, durability=DurabilityPolicy.TRANSIENT_LOCAL),
        )
        self.create_timer(0.1, lambda: self.width.publish(Int32(data=self.grid.info.width)))


def main():
    rclpy.init()
    executor = SingleThreadedExecutor()
    executor.add_node(MapViewer())
    try:
        executor.spin()
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        rclpy.try_shutdown()


main()
