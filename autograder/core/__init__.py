"""What every other package may use: errors, files, results. It knows nothing of ROS and nothing of nbgrader."""
