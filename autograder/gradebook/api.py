"""Open nbgrader's API with the course's own stages."""

from __future__ import annotations

import copy
import logging
import re
import warnings
from pathlib import Path
from typing import Any

from autograder.course.paths import CoursePaths
from autograder.gradebook.own_courses import prepare_nbgrader


def open_api(root: Path, gradebook: bool = True, **directories: Any) -> Any:
    """Return nbgrader's API with the course's own stages.

    Args:
        root: the course's folder.
        gradebook: whether labs are registered in the gradebook when they are generated.
        directories: settings that replace those of nbgrader's CourseDirectory.
    """
    prepare_nbgrader()
    from nbgrader.apps import NbGraderAPI
    from nbgrader.coursedir import CourseDirectory

    from autograder.gradebook.config import leave_gradebook_alone
    from autograder.gradebook.private_nbgrader import do_not_repeat, know_version_of_tables
    from autograder.gradebook.settings import settings_of

    know_version_of_tables()
    do_not_repeat()
    config = copy.deepcopy(settings_of(root))
    if not gradebook:
        leave_gradebook_alone(config)
    config.NbGraderAPI.log_level = logging.ERROR
    # nbgrader's log is read from its answers, so it must not also be printed on the terminal.
    for logger in ("traitlets", "tornado.application"):
        logging.getLogger(logger).addHandler(logging.NullHandler())
    warnings.filterwarnings("ignore", module=r"nbgrader\.api")
    config.CourseDirectory.merge(directories)
    CoursePaths(root).build.mkdir(exist_ok=True)
    return NbGraderAPI(CourseDirectory(config=config), config=config)


def last_error(answer: dict[str, Any]) -> str:
    """Return the last informative line of nbgrader's log."""
    text = str(answer.get("log", "")) + "\n" + str(answer.get("error", ""))
    lines: list[str] = [
        line.strip() for line in text.splitlines() if re.match(r"\s*[\w.]*(Error|Exception|Entry)\b: ", line)
    ]
    telling = [line for line in lines if "NbGraderException" not in line]
    return (telling or lines or ["no reason given"])[-1]


def answered(answer: dict[str, Any]) -> dict[str, Any]:
    """Return nbgrader's answer, or raise KeyboardInterrupt again if nbgrader has caught it."""
    if "KeyboardInterrupt" in str(answer.get("error", "")):
        raise KeyboardInterrupt
    return answer
