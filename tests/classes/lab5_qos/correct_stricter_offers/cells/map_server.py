%%node map_server
import rclpy
from nav_msgs.msg import OccupancyGrid
from rclpy.qos import qos_profile_action_status_default


def main():
    rclpy.init()
    node = rclpy.create_node("map_server")
    node.declare_parameter("width", 4)
    width = node.get_parameter("width").value
    # The profile of action status topics is just what a map needs: reliable, transient local, depth 1.
    publisher = node.create_publisher(OccupancyGrid, "map", qos_profile_action_status_default)
    grid = OccupancyGrid(data=[-1] * (width * width))
    grid.info.width, grid.info.height = width, width
    publisher.publish(grid)
    rclpy.spin(node)


if __name__ == "__main__":
    main()
