"""Where nbgrader's own commands enter: in a course they go the course's way, outside of any they execute nothing."""

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
    """Let nbgrader's commands go the course's way, in this process.

    Args:
        config: traitlets' Config, as `get_config()` gives it.
        root: of the course.
    """
    configure(config, root)
    config.Autograde.pre_convert_hook = partial(before_autograde, root)
    install(root)
    if Path.cwd().is_relative_to(root):  # the environment's configuration leads here from other folders, too
        make_folder(root)


def before_autograde(root: Path, assignment: str, student: str, notebooks: list[str]) -> None:
    """nbgrader's hook: note the lab's cells when `nbgrader autograde` meets a gradebook without them."""
    register(root, assignment)


def install(root: Path) -> None:
    """Put the course's way in place of nbgrader's, for this process, so that no setting and no other door leads there.

    Args:
        root: of the course whose checks are run.
    """
    replace_execution(
        lambda notebook, invert: verdicts(root, notebook, invert),
        lambda: KitError(
            "nbgrader's own execution is disabled in this course, because it would run students' code in your session.",
            "Use `autograder grade`, or nbgrader's commands without settings for their stages.",
        ),
    )


def close() -> None:
    """Close nbgrader's execution for this process, outside of any course."""
    what, do = "nbgrader executes nothing outside of a course.", "Start it in the folder of your course."
    replace_execution(lambda notebook, _: not_checked(notebook, what, do), lambda: KitError(what, do))
