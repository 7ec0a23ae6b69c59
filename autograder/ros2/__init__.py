"""The verbs of ROS 2's command line, with the same arguments, output and exit status, implemented with rclpy alone."""
