"""Lay a file where ROS has its folder in the home."""

from _neighbour import home, wait

(home / ".ros").write_text("no folder")
wait()
