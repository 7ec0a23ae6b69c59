"""For the authors of a course: beginning courses and labs, linting them, mutants, packages for an installed ROS 2."""
