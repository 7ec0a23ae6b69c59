# Written for Python 3.6 and up, so that an old Python meets a sentence and not a SyntaxError.
# ruff: noqa: UP006, UP031, UP035
"""The environment `.venv`: empty, finished with a marker, or thrown away."""

import contextlib
import hashlib
import json
import os
import shutil
from typing import Any, Dict, List, Tuple

from autograder.setup.commands import write_commands
from autograder.setup.interpreter import Interpreter, output_of
from autograder.setup.jupyter import lead_jupyter
from autograder.setup.places import MARKER, PYTHON, ROOT, VENV
from autograder.setup.python import lead_python
from autograder.setup.refusals import SetUpError, refuse_full_disk, tail


def digest(lock: str) -> str:
    """Return the SHA-256 of the file `lock` of the course: a lock, or the wheel of a student's kit."""
    return hashlib.sha256((ROOT / lock).read_bytes()).hexdigest()


def read_marker() -> "Dict[str, Any]":
    """Return what the finished `.venv` was made of; empty if it is unfinished, moved, or lost its Python."""
    try:
        state = json.loads(MARKER.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}
    whole = state["folder"] == str(VENV) and state["program"] == str(PYTHON.resolve())
    return state if whole and os.access(str(PYTHON), os.X_OK) else {}


def create(base: Interpreter) -> "List[str]":
    """Make an empty `.venv` on `base`; return the command that is pip for it, or an empty list if there is none.

    Raises SetUpError.
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
    """Lead the environment's programs to the kit, then write the marker as the very last act.

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
    """Declare `.venv` finished."""
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
    """Remove `.venv`, the marker first: an interrupted removal must not look finished."""
    with contextlib.suppress(OSError):
        MARKER.unlink()
    if VENV.is_symlink():
        VENV.unlink()
    elif VENV.exists():
        shutil.rmtree(str(VENV))
