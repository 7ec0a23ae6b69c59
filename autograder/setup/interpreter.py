# This file runs in Python 3.6 and newer, so that an old Python prints a message and not a SyntaxError.
# ruff: noqa: UP006, UP031, UP035, UP045
"""Find a Python on which the environment can be built."""

import json
import os
import shutil
import subprocess
from pathlib import Path
from typing import Dict, List, NamedTuple, Optional, Tuple

from autograder.setup.places import VENV
from autograder.setup.refusals import SetUpError

OLDEST, NEWEST = (3, 11), (3, 14)
PROBE = """
import json, platform, struct, sys, sysconfig
def has(name):
    try:
        __import__(name)
        return True
    except ImportError:
        return False
print(json.dumps({
    "program": sys.executable, "version": sys.version_info[:3],
    "build": "%s%s" % (platform.python_implementation(), struct.calcsize("P") * 8)
        + ("t" if sysconfig.get_config_var("Py_GIL_DISABLED") else ""),
    "venv": has("venv"), "ensurepip": has("ensurepip"), "pip": has("pip"),
}))
"""


class Interpreter(NamedTuple):
    """A Python on which `.venv` can be built."""

    program: str
    version: Tuple[int, ...]
    ensurepip: bool
    pip: bool


def clean_environment() -> "Dict[str, str]":
    """Return this process's environment without variables that would mislead another Python or pip."""
    unwanted = ("PYTHONPATH", "PYTHONHOME", "PYTHONSTARTUP", "VIRTUAL_ENV", "PIP_TARGET", "PIP_PREFIX", "PIP_USER")
    return {name: value for name, value in os.environ.items() if name not in unwanted}


def output_of(*command: str, **environ: str) -> "Tuple[int, str]":
    """Run `command` with `environ` added to a clean environment, and return its exit status and its whole output."""
    try:
        process = subprocess.Popen(
            command,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            env=dict(clean_environment(), **environ),
        )
    except OSError as error:
        return 127, str(error)
    with process:
        text = process.communicate()[0].decode("utf-8", "replace")
    return process.returncode, text


def probe(program: str) -> "Tuple[str, Optional[Interpreter]]":
    """Find out which Python `program` is.

    Return the reason why it cannot be used and None, or an empty text and the Interpreter.
    """
    status, text = output_of(program, "-I", "-c", PROBE)
    try:
        answer = json.loads(text.strip().splitlines()[-1]) if status == 0 else {}
    except (ValueError, IndexError):
        answer = {}
    if not answer:
        return "does not run", None  # for example a program of pyenv that only says that no version is chosen
    version = tuple(answer["version"])
    if not OLDEST <= version[:2] <= NEWEST:
        return "is Python %d.%d.%d" % version, None
    if answer["build"] != "CPython64":
        return "is a %s build, not CPython64" % answer["build"], None
    if not answer["venv"]:
        return "has no module venv", None
    return "", Interpreter(answer["program"], version, answer["ensurepip"], answer["pip"])


def find_python(wanted: str) -> Interpreter:
    """Return the Python to build on: `wanted` if it is named, and otherwise the first suitable one on PATH.

    Raises SetUpError if there is no suitable Python.
    """
    names = [wanted] if wanted else ["python3"] + ["python3.%d" % n for n in range(NEWEST[1], OLDEST[1] - 1, -1)]
    own = str(VENV / "bin")  # `.venv` may be active in this shell, but it cannot be built on its own Python
    path = os.pathsep.join(folder for folder in os.get_exec_path() if folder != own)
    refused: List[str] = []
    without_ensurepip = None
    for name in names:
        program = shutil.which(str(Path(name).expanduser()), path=path)
        if program is None:
            refused += ["%s does not exist" % name] if wanted else []
            continue
        why, interpreter = probe(program)
        if interpreter is None:
            refused.append("%s %s" % (program, why))
        elif interpreter.ensurepip:
            return interpreter
        else:
            without_ensurepip = without_ensurepip or interpreter
    if without_ensurepip:
        return without_ensurepip
    raise SetUpError(
        "The kit needs Python %d.%d to %d.%d, but found none:\n  " % (OLDEST + NEWEST)
        + ("\n  ".join(refused) or "no python3 on PATH"),
        "Install one (Debian, Ubuntu: sudo apt-get install python3 python3-venv), or name one:\n"
        "  make grade PYTHON=/path/to/python3.12",
    )
