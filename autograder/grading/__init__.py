"""Grades a class: stage A runs submissions, stage B hands the results to nbgrader."""
