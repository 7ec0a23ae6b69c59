"""The verbs of ROS 2's command line, with the real tool's words, output and exit status, on rclpy alone."""
