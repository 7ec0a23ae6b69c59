"""The arguments with which a ROS program is started: remap rules and parameters."""
