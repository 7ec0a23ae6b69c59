"""Closes nbgrader's own execution: in a course Validate goes the course's way, outside of any it checks nothing."""

from __future__ import annotations

from pathlib import Path

from autograder.core.errors import KitError
from autograder.gradebook.private_nbgrader import replace_execution
from autograder.grading.validate import not_checked, verdicts


def install(root: Path) -> None:
    """Put the course's way in place of nbgrader's, for this process, so that no setting and no other door leads there.

    Args:
        root: of the course whose checks are run.
    """
    replace_execution(
        lambda notebook, invert: verdicts(root, notebook, invert),
        lambda: KitError(
            "nbgrader's own execution is closed in this course: it would run students' code in your session.",
            "Use `autograder grade`, or nbgrader's commands without settings for their stages.",
        ),
    )


def close() -> None:
    """Close nbgrader's execution for this process, outside of any course."""
    what, do = "nbgrader executes nothing outside of a course.", "Start it in the folder of your course."
    replace_execution(lambda notebook, _: not_checked(notebook, what, do), lambda: KitError(what, do))
