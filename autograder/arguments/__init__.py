"""What a ROS program is started with: remap rules and parameters."""
