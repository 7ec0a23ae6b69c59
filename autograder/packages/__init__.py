"""ROS packages that students write: where their files are, how they are built, and why a build fails."""
