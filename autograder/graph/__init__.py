"""Observes the ROS graph from outside the student's process."""
