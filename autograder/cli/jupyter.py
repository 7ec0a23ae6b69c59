"""`autograder jupyter`: JupyterLab as students have it."""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from typing import NoReturn

from autograder.core.errors import KitError
from autograder.course.folder import course_root, is_students_kit
from autograder.course.paths import CoursePaths
from autograder.notebook import JUPYTER_SETTINGS
from autograder.setup.labs import put_labs


def open_labs(words: Sequence[str]) -> NoReturn:
    """Become JupyterLab in the folder of labs.

    Its settings are not those of the whole environment: an instructor who starts `jupyter lab` there has formgrader.

    Args:
        words: further options of `jupyter lab`.

    Raises:
        KitError: the course has no labs yet.
    """
    if is_students_kit():
        put_labs()
    labs = CoursePaths(course_root()).labs
    if not labs.is_dir():
        raise KitError(f"There are no labs in {labs}.", "Make them from the solutions: autograder release")
    # A student's kit is shown whole: its lectures can be opened beside the labs.
    whole = ["--LabApp.default_url=/lab/tree/labs/README.md"] if is_students_kit() else []
    os.chdir(labs.parent if whole else labs)
    environment = dict(os.environ)
    environment["JUPYTER_CONFIG_PATH"] = str(JUPYTER_SETTINGS)
    # What runs in a notebook starts the environment's programs by their bare name.
    environment["PATH"] = os.pathsep.join((os.path.dirname(sys.executable), os.environ.get("PATH", os.defpath)))  # noqa: PTH120
    root = ["--allow-root"] if os.getuid() == 0 else []
    os.execve(sys.executable, [sys.executable, "-P", "-m", "jupyterlab", *whole, *root, *words], environment)
