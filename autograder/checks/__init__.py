"""What a check cell uses: `launch`, the expectations, the values that vary."""

from autograder.checks import vary
from autograder.checks.answers import FULL_NAME, NAME_OR_NONE, answers
from autograder.checks.building import build
from autograder.checks.command_line import command_line
from autograder.checks.launch import launch, launch_file
from autograder.checks.program import Program
from autograder.checks.world import World

__all__ = [
    "FULL_NAME",
    "NAME_OR_NONE",
    "Program",
    "World",
    "answers",
    "build",
    "command_line",
    "launch",
    "launch_file",
    "vary",
]
