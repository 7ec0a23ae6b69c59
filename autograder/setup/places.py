# Written for Python 3.6 and up, so that an old Python meets a sentence and not a SyntaxError.
"""Where the course lies that this is the environment of, a checkout or a student's kit, and the environment itself."""

import sys
from pathlib import Path

KIT_FOLDER = "kit"
"""The folder of a student's kit with what is not the student's to change."""
MARKER_NAME = "autograder-ready.json"
_ABOVE = Path(__file__).resolve().parent.parent.parent
"""What this package lies in: a checkout, a wheel, or an environment's folder of packages."""


def _root() -> Path:
    if _ABOVE.suffix == ".whl":  # set-up begins in a student's kit, where nothing is installed yet
        return _ABOVE.parent.parent
    environment = Path(sys.prefix).resolve()
    if environment in _ABOVE.parents and (environment / MARKER_NAME).is_file():
        return environment.parent
    return _ABOVE


ROOT = _root()
WHEEL = "%s/%s" % (_ABOVE.parent.name, _ABOVE.name) if _ABOVE.suffix == ".whl" else ""  # noqa: UP031
"""The kit's wheel, from `ROOT`, while a student's kit is set up from it; else empty."""
VENV = ROOT / ".venv"
PYTHON = VENV / "bin" / "python"
MARKER = VENV / MARKER_NAME
STUDENT_LOCK, DEV_LOCK = "requirements.lock", "requirements-dev.lock"
