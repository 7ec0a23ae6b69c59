"""Runs one `ros2` command, from its words to its exit status."""

from __future__ import annotations

import argparse
import importlib
import signal
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from autograder.core import interrupts
from autograder.ros2.failure import Failure, TimeIsUp

if TYPE_CHECKING:
    from autograder.graph.observer import Observer

PROFILE = Path(__file__).resolve().parent / "fastdds.xml"
"""The profile by which a command in a terminal discovers other programs. `FASTRTPS_DEFAULT_PROFILES_FILE` names it."""

COMMANDS = {
    "action": "Various action related sub-commands",
    "interface": "Show information about ROS interfaces",
    "lifecycle": "Various lifecycle related sub-commands",
    "node": "Various node related sub-commands",
    "param": "Various param related sub-commands",
    "service": "Various service related sub-commands",
    "topic": "Various topic related sub-commands",
}
ELSEWHERE = {
    "run": 'A program is started by `python nodes/NOTEBOOK/NAME.py --ros-args …`, or in a notebook by launch("NAME").',
    "launch": 'A launch file is started in a notebook by launch_file("NAME.launch.yaml", package=…), and after '
    "`autograder package` by an installed Jazzy.",
    "doctor": "`autograder doctor` says what this machine offers.",
    "wtf": "`autograder doctor` says what this machine offers.",
    "daemon": "There is no daemon: each command joins the graph itself.",
    "bag": "Recording needs rosbag2, which only an installed Jazzy has.",
    "component": "Components are C++ libraries, which only an installed Jazzy loads.",
    "multicast": "`autograder doctor` says what this machine offers.",
    "security": "Keys and certificates need SROS 2, which only an installed Jazzy has.",
    "extension_points": "The kit's commands are fixed: nothing extends them.",
    "extensions": "The kit's commands are fixed: nothing extends them.",
    "pkg": "Packages are made by `autograder package`; their interfaces are shown by `ros2 interface packages`.",
}
"""The other commands of the real tool, and what the kit has in place of them."""


def run(
    words: Sequence[str],
    domain_id: int | None = None,
    observer: Observer | None = None,
    seconds: float | None = None,
) -> int:
    """Run `ros2 WORDS`, print its output, and return its exit status.

    Args:
        words: the command, its verb and their arguments.
        domain_id: ROS_DOMAIN_ID, or None for that of the environment.
        observer: an observer that has already discovered this graph, so that the verb knows when it sees all of it.
        seconds: the time limit after which a verb that would continue is ended.

    Raises:
        TimeIsUp: the verb was ended because of the time limit.
    """
    if words and words[0] in ELSEWHERE:
        print(f"`ros2 {words[0]}` is not part of this kit. {ELSEWHERE[words[0]]}", file=sys.stderr)
        return 1
    try:
        options = _parser(words).parse_args(list(words))
    except SystemExit as end:
        return int(end.code or 0)
    from rclpy.exceptions import NameValidationException

    from autograder.ros2.session import Session

    session = Session(domain_id, observer, seconds)
    session.options = options
    try:
        options.run(session, options)
    except (Failure, NameValidationException) as failure:
        sys.stdout.flush()
        if str(failure):
            print(failure, file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        if interrupts.held():  # the rest of the cell must not run
            raise
        return int(signal.SIGINT)
    finally:
        session.close()
        sys.stdout.flush()
    return 0


def verbs_of(command: str) -> list[str]:
    """Return the verbs of a command; the list is empty if there is no such command."""
    if command not in COMMANDS:
        return []
    verbs = argparse.ArgumentParser().add_subparsers()
    importlib.import_module(f"autograder.ros2.{command}").add_verbs(verbs)
    return list(verbs.choices or ())


def _parser(words: Sequence[str]) -> argparse.ArgumentParser:
    """Return a parser for these words.

    It has the verbs of the command in them, and only the names of other commands.
    """
    parser = argparse.ArgumentParser(prog="ros2", description="ros2 is an extensible command-line tool for ROS 2.")
    commands = parser.add_subparsers(title="Commands", metavar="<command>", required=False)
    parser.set_defaults(run=lambda *_: parser.print_help())
    wanted = next((word for word in words if not word.startswith("-")), "")
    for name, text in COMMANDS.items():
        command = commands.add_parser(name, help=text, description=text)
        if name == wanted:
            verbs = command.add_subparsers(title="Verbs", metavar="<verb>")
            command.set_defaults(run=lambda *_, command=command: command.print_help())
            importlib.import_module(f"autograder.ros2.{name}").add_verbs(verbs)
    return parser


__all__ = ["TimeIsUp", "run"]
