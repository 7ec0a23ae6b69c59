"""The commands `autograder` and `ros2`."""

import sys


def main() -> None:
    """Run `autograder`. Its modules are imported here, because `ros2` does not need them."""
    if sys.argv[1:2] == ["ros2"]:  # Typer must not parse the words of `ros2`, and `ros2` must start quickly
        _ros2(sys.argv[2:])
    from autograder.cli.main import main as run

    run()


def ros2() -> None:
    """Run `ros2`: the command of an installed ROS if there is one, and otherwise the kit's own."""
    _ros2(sys.argv[1:])


def _ros2(words: list[str]) -> None:
    from autograder.cli.ros2 import ros2 as run

    sys.exit(run(words))
