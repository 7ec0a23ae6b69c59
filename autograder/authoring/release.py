"""Gives a lab out: only one in which nothing is wrong that can be read."""

from __future__ import annotations

from pathlib import Path

from autograder.authoring.lint.static import read_findings, release_findings
from autograder.core.errors import KitError
from autograder.core.files import write_beside
from autograder.course.paths import CoursePaths
from autograder.gradebook.release import released_files


def release(root: Path, lab: str) -> Path:
    """Write `labs/<lab>` and return that folder.

    Raises:
        KitError: there is no such lab under `solutions`, nbgrader refuses, or the lab has an error; says in which cell.
    """
    found = read_findings(root, lab)
    errors = [one for one in found if not one.warning]
    if not errors:
        files = released_files(root, lab)
        errors = release_findings(files)
    if errors:
        raise KitError(f"{lab} is not released:\n" + "\n".join(f"  {one}" for one in errors), "Repair these cells.")
    folder = CoursePaths(root).labs / lab
    for path, content in files.items():
        write_beside(folder / path, content)
    return folder
