"""The commands for instructors. The kit that students get contains neither these commands nor what they import."""

from autograder.cli import answers, bank, explain, grade, labs, replay, results, viva  # noqa: F401  each module registers its commands
