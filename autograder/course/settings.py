"""A course's settings, `course.toml`. What concerns nbgrader stands in nbgrader's own file, `nbgrader_config.py`."""

from __future__ import annotations

import tomllib
from pathlib import Path

from pydantic import BaseModel, ConfigDict, ValidationError

from autograder.core.errors import KitError

SETTINGS_FILE = "course.toml"


class CourseSettings(BaseModel):
    """What `course.toml` may say; a course without one has these values."""

    model_config = ConfigDict(extra="forbid")

    title: str = "The labs"
    """Heading of the students' start page."""
    labs: list[str] = []
    """The labs in the course's order; those that it leaves out follow by their names."""
    executor: str = "local"
    """Who runs the jobs of a class, `NAME` or `NAME://ADDRESS`, by the names of `autograder.grading.executors`."""


def read_settings(root: Path) -> CourseSettings:
    """Read the settings of the course at `root`.

    Raises:
        KitError: the file cannot be read, or says what no course can say.
    """
    path = root / SETTINGS_FILE
    try:
        return CourseSettings.model_validate(tomllib.loads(path.read_text(encoding="utf-8")))
    except FileNotFoundError:
        return CourseSettings()
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise KitError(f"{path} is no TOML: {error}.", "Repair that line.") from error
    except ValidationError as error:
        first = error.errors()[0]
        key = ".".join(map(str, first["loc"]))
        if first["type"] == "extra_forbidden":
            known = ", ".join(CourseSettings.model_fields)
            raise KitError(f"{path} sets `{key}`, which is no setting of a course.", f"Settings: {known}.") from error
        raise KitError(f"{path}: `{key}` cannot be {first['input']!r}: {first['msg']}.", "Repair that line.") from error
