"""Write a lab's autograder for Gradescope. From this zip, Gradescope builds an image that checks each submission.

Source: Gradescope's "Autograder Specifications". `setup.sh` and `run_autograder` are at the top of the zip, which is
unpacked to /autograder/source.
"""

from __future__ import annotations

import io
import stat
import zipfile
from pathlib import Path

from autograder.core.errors import KitError
from autograder.core.files import write_beside
from autograder.course.lab import load_lab
from autograder.course.paths import CoursePaths
from autograder.course.settings import SETTINGS_FILE
from autograder.setup.places import ROOT, STUDENT_LOCK

_TEMPLATES = Path(__file__).with_name("templates")
_ALWAYS = (1980, 1, 1, 0, 0, 0)
"""The date of every file in the zip. It is always the same, so that equal sources give equal zips."""


def write_gradescope(root: Path, lab: str, path: Path) -> Path:
    """Write the zip and return its path.

    Args:
        root: the course's folder.
        lab: the lab whose submissions are checked.
        path: the zip file to write.

    Raises:
        KitError: there is no such lab, or the kit was installed from a wheel, which does not contain the lock.
    """
    if not (ROOT / STUDENT_LOCK).is_file():
        raise KitError("The zip is made from a checkout of the kit.", "Run the command there, in your course's folder.")
    notebook = load_lab(root, lab).notebook
    files = {
        "setup.sh": (_TEMPLATES / "gradescope_setup.sh").read_bytes(),
        "run_autograder": (_TEMPLATES / "gradescope_run.sh").read_bytes().replace(b"@LAB@", lab.encode()),
        f"kit/{STUDENT_LOCK}": (ROOT / STUDENT_LOCK).read_bytes(),
        f"course/{CoursePaths(root).solutions.name}/{lab}/{notebook.name}": notebook.read_bytes(),
    }
    if (root / SETTINGS_FILE).is_file():
        files[f"course/{SETTINGS_FILE}"] = (root / SETTINGS_FILE).read_bytes()
    for file in sorted((ROOT / "autograder").rglob("*")):
        if file.is_file() and "__pycache__" not in file.parts:
            files[f"kit/{file.relative_to(ROOT)}"] = file.read_bytes()
    content = io.BytesIO()
    with zipfile.ZipFile(content, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in files.items():
            info = zipfile.ZipInfo(name, _ALWAYS)
            info.compress_type = zipfile.ZIP_DEFLATED
            runs = "/" not in name
            info.external_attr = (stat.S_IFREG | (0o755 if runs else 0o644)) << 16
            archive.writestr(info, data)
    _refuse_another_zip(path)
    write_beside(path, content.getvalue())
    return path


def _refuse_another_zip(path: Path) -> None:
    """Do not replace a file that is no autograder, such as the submissions that somebody got from Gradescope."""
    if not path.exists():
        return
    try:
        with zipfile.ZipFile(path) as archive:
            if "run_autograder" in archive.namelist():
                return
    except (OSError, zipfile.BadZipFile):
        pass
    raise KitError(f"{path} exists already, and is no autograder for Gradescope.", "Name another file.")
