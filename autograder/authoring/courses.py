"""Create courses and labs: a new course, a new lab, and the course in which sample classes are graded."""

from __future__ import annotations

import contextlib
import json
import re
from pathlib import Path

from autograder.core.errors import KitError
from autograder.core.files import write_beside
from autograder.course.paths import CoursePaths
from autograder.course.settings import SETTINGS_FILE
from autograder.gradebook.own_courses import TEMPLATE, trust
from autograder.gradebook.settings import CONFIG_FILE

FIRST_LAB = "lab1_greeter"
_TEMPLATES = Path(__file__).with_name("templates")
_SETTINGS = """\
# The heading of the students' start page.
title = "The labs"
# The labs in the course's order. Labs that are not listed follow in the order of their names.
labs = ["{lab}"]

# The names that hints use for your lectures, with the page of each lecture, and the sections of a lecture, each with
# the codes of the reasons that it explains.
# [lectures]
# "Week 1" = "01_names"
# [sections."Week 1"]
# "Remap rules" = ["rule-order", "rule-prefix"]
"""
_IGNORED = """\
# Files that can be generated again, and files with students' data.
/build/
/gradebook/
/bank/
/roster.csv
/handed_in/
/labs/*/nodes/
/solutions/*/nodes/
.ipynb_checkpoints/
"""


def new_course(root: Path) -> list[Path]:
    """Write a course with one lab into a folder that is empty or does not exist yet, and return the course's files.

    Raises:
        KitError: the folder is not empty, or it is a file.
    """
    if root.exists() and (not root.is_dir() or any(root.iterdir())):
        what = "is not empty" if root.is_dir() else "is a file"
        raise KitError(f"{root} {what}, so it was not changed.", "Name a folder that does not exist yet.")
    files = {
        SETTINGS_FILE: _SETTINGS.format(lab=FIRST_LAB),
        CONFIG_FILE: TEMPLATE.read_text(encoding="utf-8"),
        ".gitignore": _IGNORED,
    }
    for name, text in files.items():
        write_beside(root / name, text)
    return [*(root / name for name in files), *new_lab(root, FIRST_LAB)]


def new_lab(root: Path, name: str) -> list[Path]:
    """Write a lab with one program and one table into a course, and return the lab's files.

    Raises:
        KitError: the name is not allowed for a lab, or there is already a lab with this name.
    """
    if not re.fullmatch(r"[a-z][a-z0-9_]{0,63}", name):
        raise KitError(
            f"`{name[:80]}` cannot name a lab.", "Use small letters, digits and underscores, and begin with a letter."
        )
    paths = CoursePaths(root)
    notebook = paths.solutions / name / f"{name}.ipynb"
    if notebook.exists() or (paths.labs / name).exists():
        raise KitError(f"There is already a lab `{name}`, and it was not changed.", "Choose another name.")
    requirements, canaries = paths.requirements(name), paths.canaries(name)
    raw = json.loads((_TEMPLATES / "lab.ipynb").read_text(encoding="utf-8"))
    raw["cells"][0]["source"] = raw["cells"][0]["source"].replace("LAB_TITLE", name.replace("_", " ").capitalize())
    write_beside(notebook, json.dumps(raw, indent=1, ensure_ascii=False) + "\n")
    for path in (requirements, canaries):
        write_beside(path, (_TEMPLATES / path.name).read_text(encoding="utf-8"))
    return [notebook, requirements, canaries]


def sample_course(root: Path) -> Path:
    """Create the course for sample classes below the course at `root`, and return its folder."""
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
