"""Errors, files, results and other basics that every package may use. Nothing here depends on ROS or nbgrader."""
