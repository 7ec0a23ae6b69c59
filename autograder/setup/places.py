# Written for Python 3.6 and up, so that an old Python meets a sentence and not a SyntaxError.
"""Where the checkout and its environment lie."""

from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent.parent
VENV = ROOT / ".venv"
PYTHON = VENV / "bin" / "python"
MARKER = VENV / "autograder-ready.json"
STUDENT_LOCK, DEV_LOCK = "requirements.lock", "requirements-dev.lock"
