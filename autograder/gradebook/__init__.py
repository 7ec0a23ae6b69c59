"""Recording results with nbgrader: gradebook, feedback, releases."""
