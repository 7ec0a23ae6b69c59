"""The door for nbgrader's own commands: `nbgrader_config.py` puts the course's ways in place of nbgrader's."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Any

from autograder.gradebook.config import configure
from autograder.gradebook.keeping import make_room
from autograder.gradebook.release import register
from autograder.gradebook.validate import install


def take_over(config: Any, root: Path) -> None:
    """Let nbgrader's commands go the course's way, in this process.

    Args:
        config: traitlets' Config, as `get_config()` gives it.
        root: of the course.
    """
    configure(config, root)
    config.Autograde.pre_convert_hook = partial(before_autograde, root)
    install(root)
    if Path.cwd().is_relative_to(root):  # the environment's configuration leads here from other folders, too
        make_room(root)


def before_autograde(root: Path, assignment: str, student: str, notebooks: list[str]) -> None:
    """nbgrader's hook: note the lab's cells when `nbgrader autograde` meets a gradebook without them."""
    register(root, assignment)
