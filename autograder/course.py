"""Where the course lies: the folder that holds `solutions/`, `labs/` and `build/`."""

from __future__ import annotations

from pathlib import Path

from autograder.errors import KitError


def course_root(*starts: Path) -> Path:
    """Return the course that one of these paths lies in; then that of the working folder; then the kit's own.

    Raises:
        KitError: there is none.
    """
    kit = Path(__file__).resolve().parent.parent
    for start in (*starts, Path.cwd(), kit):
        for folder in (start.resolve(), *start.resolve().parents):
            if (folder / "solutions").is_dir() or (folder / "labs").is_dir():
                return folder
    raise KitError(
        "There is no course here: no folder with `solutions` or `labs`.", "Run it inside the course's folder."
    )
