"""The course that the sample classes are graded in: the same labs, and a gradebook of its own."""

from __future__ import annotations

import contextlib
from pathlib import Path

from autograder.core.files import write_beside
from autograder.course.paths import CoursePaths
from autograder.course.settings import SETTINGS_FILE
from autograder.gradebook.own_courses import TEMPLATE, trust
from autograder.gradebook.settings import CONFIG_FILE


def sample_course(root: Path) -> Path:
    """Make the course for sample classes below the course at `root`, and return its folder."""
    sample = CoursePaths(root).sample_course
    sample.mkdir(parents=True, exist_ok=True)
    for path in (CoursePaths(root).solutions, CoursePaths(root).labs, root / "tests"):
        link = sample / path.name
        if not link.is_symlink():
            link.symlink_to(path, target_is_directory=True)
    settings = root / SETTINGS_FILE
    write_beside(sample / SETTINGS_FILE, settings.read_bytes() if settings.is_file() else b"")
    write_beside(sample / CONFIG_FILE, TEMPLATE.read_bytes())
    with contextlib.suppress(OSError):  # the kit's own commands do not need it
        trust(sample)
    return sample
