"""Entry points for nbgrader's own commands, which use the course's stages in a course and execute nothing elsewhere."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Any

from autograder.core.errors import KitError
from autograder.gradebook.config import configure
from autograder.gradebook.database import make_folder
from autograder.gradebook.private_nbgrader import replace_execution
from autograder.gradebook.release import register
from autograder.grading.nbgrader_validate import not_checked, verdicts


def take_over(config: Any, root: Path) -> None:
    """Make nbgrader's commands in this process use the course's layout and stages.

    Args:
        config: the Config of traitlets that `get_config()` returns.
        root: the course's folder.
    """
    configure(config, root)
    config.Autograde.pre_convert_hook = partial(before_autograde, root)
    install(root)
    if Path.cwd().is_relative_to(root):  # this may also be called in other folders, by the environment's configuration
        make_folder(root)


def before_autograde(root: Path, assignment: str, student: str, notebooks: list[str]) -> None:
    """Register the lab's cells in a gradebook that does not have them. `nbgrader autograde` calls this first."""
    register(root, assignment)


def install(root: Path) -> None:
    """Replace nbgrader's execution in this process, so that no setting and no other command can use it.

    Args:
        root: the folder of the course whose checks are run.
    """
    replace_execution(
        lambda notebook, invert: verdicts(root, notebook, invert),
        lambda: KitError(
            "nbgrader's own execution is disabled in this course, because it would run students' code in your session.",
            "Use `autograder grade`, or nbgrader's commands without settings for their stages.",
        ),
    )


def close() -> None:
    """Disable nbgrader's execution in this process, which is not in a course."""
    what, do = "nbgrader executes nothing outside of a course.", "Start it in the folder of your course."
    replace_execution(lambda notebook, _: not_checked(notebook, what, do), lambda: KitError(what, do))
