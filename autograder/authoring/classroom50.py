"""Write a lab's autograder for Classroom 50, which runs it in each student's repository when something is pushed.

Source: Classroom 50's wiki, "Advanced Autograding". What lies in the folder of an assignment is published on a page
that students can reach. Therefore the autograder checks with the students' kit, which has neither solutions nor hidden
tests.
"""

from __future__ import annotations

import tempfile
from pathlib import Path

from autograder.authoring.student_kit import write_kit
from autograder.core.errors import KitError
from autograder.core.files import write_beside
from autograder.course.lab import load_lab

_TEMPLATE = Path(__file__).with_name("templates") / "classroom50_autograder.template"
_MOST = 10 * 2**20
"""Bytes that Classroom 50's runner fetches at most. Source: `MAX_FETCH_BYTES` in its runner.py."""


def write_classroom50(root: Path, lab: str, into: Path) -> list[Path]:
    """Write `autograder.py` and the students' kit, and return their paths.

    Args:
        root: the course's folder.
        lab: the lab whose submissions are checked.
        into: the folder of the assignment, `CLASSROOM/autograders/ASSIGNMENT` in the classroom's repository.

    Raises:
        KitError: there is no such lab, the students' kit cannot be built, or it is larger than what is fetched.
    """
    found = load_lab(root, lab)
    with tempfile.TemporaryDirectory() as folder:
        kit = write_kit(root, None, Path(folder)).read_bytes()
    if len(kit) > _MOST:
        size = f"The students' kit has {len(kit) / 2**20:.1f} MiB"
        raise KitError(
            f"{size}, and Classroom 50 fetches only {_MOST / 2**20:.0f} MiB.", "Take large files out of labs/."
        )
    into.mkdir(parents=True, exist_ok=True)
    program = _TEMPLATE.read_text(encoding="utf-8").replace("@LAB@", found.name)
    made = {into / "autograder.py": program.encode(), into / "kit.zip": kit}
    for path, content in made.items():
        write_beside(path, content)
    return list(made)
