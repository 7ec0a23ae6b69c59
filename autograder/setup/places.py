# This file runs in Python 3.6 and newer, so that an old Python prints a message and not a SyntaxError.
"""The paths of the checkout or student's kit to which this environment belongs, and of the environment itself."""

import sys
from pathlib import Path

KIT_FOLDER = "kit"
"""The folder of a student's kit with the files that the student must not change."""
MARKER_NAME = "autograder-ready.json"
_ABOVE = Path(__file__).resolve().parent.parent.parent
"""The folder or file that contains this package: a checkout, a wheel, or an environment's folder of packages."""


def _root() -> Path:
    if _ABOVE.suffix == ".whl":  # set-up runs from the wheel of a student's kit before anything is installed
        return _ABOVE.parent.parent
    environment = Path(sys.prefix).resolve()
    if environment in _ABOVE.parents and (environment / MARKER_NAME).is_file():
        return environment.parent
    return _ABOVE


ROOT = _root()
WHEEL = "%s/%s" % (_ABOVE.parent.name, _ABOVE.name) if _ABOVE.suffix == ".whl" else ""  # noqa: UP031
"""The path of the kit's wheel relative to `ROOT` while a student's kit is set up from it; otherwise empty."""
VENV = ROOT / ".venv"
PYTHON = VENV / "bin" / "python"
MARKER = VENV / MARKER_NAME
STUDENT_LOCK, DEV_LOCK = "requirements.lock", "requirements-dev.lock"
