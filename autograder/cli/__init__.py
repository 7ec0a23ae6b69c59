"""The commands `autograder` and `ros2`."""

import sys


def main() -> None:
    """Run `autograder`. Its modules are loaded only then, because `ros2` does not need them."""
    if sys.argv[1:2] == ["ros2"]:  # Typer must not read its words, and it must start quickly
        _ros2(sys.argv[2:])
    from autograder.cli.main import main as run

    run()


def ros2() -> None:
    """Run `ros2`: that of an installed ROS, if there is one, or else the kit's."""
    _ros2(sys.argv[1:])


def _ros2(words: list[str]) -> None:
    from autograder.cli.ros2 import ros2 as run

    sys.exit(run(words))
