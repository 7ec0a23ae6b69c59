# Written for Python 3.6 and up, so that an old Python meets a sentence and not a SyntaxError.
"""Leads the Python of a checkout's or a student's environment to the kit; elsewhere the wheel brings its file along."""

from autograder.setup.first_lines import FILE, TEXT
from autograder.setup.places import ROOT, VENV, WHEEL


def lead_python() -> None:
    """Write the file that each Python of the environment reads first, if it says something else."""
    text = TEXT if WHEEL else "%s\n%s" % (ROOT, TEXT)  # noqa: UP031
    for folder in VENV.glob("lib/python3*/site-packages"):
        file = folder / FILE
        if not file.exists() or file.read_text(encoding="utf-8") != text:
            file.write_text(text, encoding="utf-8")
