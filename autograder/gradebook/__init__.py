"""Work with nbgrader: record results in the gradebook, write feedback, and release labs."""
