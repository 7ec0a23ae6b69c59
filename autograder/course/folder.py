"""Where the course lies: the folder that holds `solutions/`, `labs/` and `build/`.

A student's kit has two: `labs/`, where the student works, and below `kit/` the labs as they were handed out, whose
checks are run.
"""

from __future__ import annotations

from pathlib import Path

from autograder.core.errors import KitError
from autograder.course.settings import SETTINGS_FILE
from autograder.setup.places import KIT_FOLDER, ROOT


def course_root(named: Path | None = None) -> Path:
    """Return the course that was named, or else the one that the working folder lies in, or else the kit's own.

    For who works on a course; whose checks are run on what somebody handed in, `trusted_course` says.

    Raises:
        KitError: there is none.
    """
    if named is not None:
        return _named(named)
    for folder in (Path.cwd(), *Path.cwd().parents, ROOT):
        if _is_course(folder):
            return folder
    raise KitError(
        "There is no course here: no folder with `solutions` or `labs`.",
        "Run it inside the course's folder, or begin one: autograder new course DIR",
    )


def trusted_course(named: Path | None) -> Path:
    """Return the course whose checks may be run on a notebook: the one that was named, or the kit's own.

    Never what lies beside the notebook, above it, or in the working folder: whoever handed in the notebook may have put
    it there, and check cells are trusted code.

    Raises:
        KitError: there is none.
    """
    own = ROOT / KIT_FOLDER if is_students_kit() else ROOT
    if named is not None:
        return _named(named)
    if not _is_course(own):
        raise KitError("The kit was installed without a course of its own.", "Name yours: --course FOLDER")
    return own


def _named(folder: Path) -> Path:
    root = folder.resolve()
    if not _is_course(root):
        needs = "It needs a folder `solutions` (or `labs`) with NAME/NAME.ipynb."
        raise KitError(f"There is no course in {root}.", needs)
    return root


def is_students_kit() -> bool:
    """Whether this is the environment of a student's kit, which has no solutions and grades nobody."""
    return _is_course(ROOT / KIT_FOLDER)


def book_of_kit() -> Path | None:
    """Return the folder of the lectures in a student's kit; None if this is none, or it came without."""
    folder = ROOT / "lectures"
    return folder if is_students_kit() and (folder / "index.html").is_file() else None


def _is_course(folder: Path) -> bool:
    """Whether it has a course's settings, or a lab; many folders called `labs` hold something else."""
    return (folder / SETTINGS_FILE).is_file() or any(
        path.stem == path.parent.name for name in ("solutions", "labs") for path in (folder / name).glob("*/*.ipynb")
    )
