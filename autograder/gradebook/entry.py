"""The door for nbgrader's own commands: `nbgrader_config.py` puts the course's ways in place of nbgrader's."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Any

from autograder.gradebook.config import configure
from autograder.gradebook.release import register
from autograder.gradebook.settings import gradebook_address
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


def before_autograde(root: Path, assignment: str, student: str, notebooks: list[str]) -> None:
    """nbgrader's hook: note the lab's cells when `nbgrader autograde` meets a gradebook without them."""
    from nbgrader.api import Gradebook, MissingEntry

    with Gradebook(gradebook_address(root)) as gradebook:
        try:
            gradebook.find_notebook(assignment, assignment)
        except MissingEntry:
            known = False
        else:
            known = True
    if not known:
        register(root, assignment)
