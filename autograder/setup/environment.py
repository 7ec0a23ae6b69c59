# This file runs in Python 3.6 and newer, so that an old Python prints a message and not a SyntaxError.
# ruff: noqa: UP006, UP031, UP035
"""Create the environment `.venv`, connect it with the kit and the course, mark it as finished, or remove it."""

import contextlib
import hashlib
import json
import os
import shutil
from typing import Any, Dict, List, Tuple

from autograder.setup.first_lines import FILE, TEXT
from autograder.setup.interpreter import Interpreter, output_of
from autograder.setup.places import MARKER, PYTHON, ROOT, VENV, WHEEL
from autograder.setup.refusals import SetUpError, refuse_full_disk, tail

# A #! line must not contain a path with a space, and is cut off after 127 bytes. Therefore /bin/sh starts the Python
# that is beside this file. The last two lines are guarded, because processes of a pool import the main script again.
_COMMAND = (
    '#!/bin/sh\n\'\'\'exec\' "$(dirname "$(readlink -f "$0")")/python" "$0" "$@"\n\' \'\'\'\n'
    "import sys\n\nfrom autograder.cli import %s\n\nif __name__ == '__main__':\n    sys.exit(%s())\n"
)


def write_commands() -> None:
    """Write the commands `autograder` and `ros2` if they are missing or have an earlier form."""
    for name, function in (("autograder", "main"), ("ros2", "ros2")):
        command = VENV / "bin" / name
        text = _COMMAND % (function, function)
        if not command.exists() or command.read_text(encoding="utf-8") != text:
            command.write_text(text, encoding="utf-8")
            command.chmod(0o755)


def lead_jupyter() -> None:
    """Make nbgrader, nbconvert and kernels of this environment use the course's configuration, wherever they start.

    Without this, nbgrader would use its own stages outside of the course's folder, and these run students' code.
    nbconvert would write reports into Markdown as HTML, although they also have a plain text. Kernels could not explain
    what to do if a notebook's first cell was not run.
    """
    if WHEEL:
        return
    ours = ROOT / "autograder" / "notebook" / "jupyter"
    for folder, config in (
        ("jupyter", ROOT / "nbgrader_config.py"),
        ("jupyter", ours / "jupyter_nbconvert_config.json"),
        ("ipython", ours / "ipython_kernel_config.json"),
    ):
        link = VENV / "etc" / folder / config.name
        if not link.exists() or link.resolve() != config:
            with contextlib.suppress(OSError):
                link.unlink()
            link.parent.mkdir(parents=True, exist_ok=True)
            link.symlink_to(config)


def lead_python() -> None:
    """Write the file that each Python of the environment reads first, unless the file is already up to date."""
    text = TEXT if WHEEL else "%s\n%s" % (ROOT, TEXT)
    for folder in VENV.glob("lib/python3*/site-packages"):
        file = folder / FILE
        if not file.exists() or file.read_text(encoding="utf-8") != text:
            file.write_text(text, encoding="utf-8")


def digest(lock: str) -> str:
    """Return the SHA-256 of the file `lock` below `ROOT`, which is a lock or the wheel of a student's kit."""
    return hashlib.sha256((ROOT / lock).read_bytes()).hexdigest()


def read_marker() -> "Dict[str, Any]":
    """Return the marker of `.venv`; empty if `.venv` is not finished, was moved, or has lost its Python."""
    try:
        state = json.loads(MARKER.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}
    whole = state["folder"] == str(VENV) and state["program"] == str(PYTHON.resolve())
    return state if whole and os.access(str(PYTHON), os.X_OK) else {}


def create(base: Interpreter) -> "List[str]":
    """Create an empty `.venv` on `base`, and return the command that runs pip for it, or an empty list without pip.

    Raises SetUpError if `.venv` cannot be created.
    """
    options = [] if base.ensurepip else ["--without-pip"]
    status, text = output_of(base.program, "-I", "-m", "venv", *options, str(VENV))
    if status:
        refuse_full_disk(text)
        raise SetUpError(
            "%s -m venv failed:\n%s" % (base.program, tail(text)), "Debian, Ubuntu: sudo apt-get install python3-venv"
        )
    if base.ensurepip:
        return [str(PYTHON), "-m", "pip"]
    return [base.program, "-m", "pip", "--python", str(PYTHON)] if base.pip else []


def finish(locks: "List[str]", version: "Tuple[int, ...]") -> None:
    """Connect the environment's programs with the kit, and then, as the last step, write the marker.

    Raises SetUpError if the new Python does not run.
    """
    status, text = output_of(str(PYTHON), "-I", "-c", "")
    if status:
        raise SetUpError("The new Python does not run:\n%s" % tail(text), "rm -rf .venv, then try again.")
    lead_python()
    write_commands()
    lead_jupyter()
    write_marker(locks, version)


def write_marker(locks: "List[str]", version: "Tuple[int, ...]") -> None:
    """Write the marker that says that `.venv` is finished."""
    state = {
        "folder": str(VENV),
        "program": str(PYTHON.resolve()),
        "version": version,
        "locks": {lock: digest(lock) for lock in locks},
    }
    beside = MARKER.with_suffix(".new")
    beside.write_text(json.dumps(state, indent=1) + "\n", encoding="utf-8")
    beside.rename(MARKER)


def discard() -> None:
    """Remove `.venv`. The marker is removed first, so that `.venv` does not look finished if this is interrupted."""
    with contextlib.suppress(OSError):
        MARKER.unlink()
    if VENV.is_symlink():
        VENV.unlink()
    elif VENV.exists():
        shutil.rmtree(str(VENV))
