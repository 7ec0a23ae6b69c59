"""Lay modules with the names of those of ROS beside the notebook."""

from _neighbour import shadow, wait

shadow("rclpy.py", "std_msgs/__init__.py")
wait()
