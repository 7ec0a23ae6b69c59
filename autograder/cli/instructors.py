"""The commands of who keeps a course and grades it; students get the kit without them and what they import."""

from autograder.cli import explain, grade, labs, results  # noqa: F401  each registers its commands
