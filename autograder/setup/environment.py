# Written for Python 3.6 and up, so that an old Python meets a sentence and not a SyntaxError.
# ruff: noqa: UP006, UP031, UP035
"""The environment `.venv`: made empty, pointed to the kit and the course, finished with a marker, or removed."""

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

# A #! line can hold no space and is cut at 127 bytes: /bin/sh starts the Python that lies beside this file.
# Guarded, since processes of a pool import the main script once more.
_COMMAND = (
    '#!/bin/sh\n\'\'\'exec\' "$(dirname "$(readlink -f "$0")")/python" "$0" "$@"\n\' \'\'\'\n'
    "import sys\n\nfrom autograder.cli import %s\n\nif __name__ == '__main__':\n    sys.exit(%s())\n"
)


def write_commands() -> None:
    """Write those that are missing or of an earlier form."""
    for name, function in (("autograder", "main"), ("ros2", "ros2")):
        command = VENV / "bin" / name
        text = _COMMAND % (function, function)
        if not command.exists() or command.read_text(encoding="utf-8") != text:
            command.write_text(text, encoding="utf-8")
            command.chmod(0o755)


def lead_jupyter() -> None:
    """Let nbgrader, nbconvert and kernels of this environment use the course's configuration, wherever they start.

    Started elsewhere than in the course, nbgrader would go on with its own stages, which run what students wrote.
    nbconvert would write reports into Markdown as HTML, though they have a plain text. Kernels would not know what to
    say when a notebook's first cell was not run.
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
    """Write the file that each Python of the environment reads first, if it says something else."""
    text = TEXT if WHEEL else "%s\n%s" % (ROOT, TEXT)
    for folder in VENV.glob("lib/python3*/site-packages"):
        file = folder / FILE
        if not file.exists() or file.read_text(encoding="utf-8") != text:
            file.write_text(text, encoding="utf-8")


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
