"""ROS packages that students write: where their files lie, how they are built, and why a build fails."""
