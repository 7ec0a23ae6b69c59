"""What a check cell uses: `launch`, the expectations, the values that vary."""

from autograder.checks import vary
from autograder.checks.answers import answers
from autograder.checks.launch import Node, launch

__all__ = ["Node", "answers", "launch", "vary"]
