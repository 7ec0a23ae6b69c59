# Written for Python 3.6 and up, so that an old Python meets a sentence and not a SyntaxError.
# ruff: noqa: UP006, UP031, UP035
"""Fills the environment with what a lock pins."""

import os
import re
import shutil
import sys
from pathlib import Path
from typing import Dict, List

from autograder.setup.interpreter import output_of
from autograder.setup.places import PYTHON, ROOT, VENV, WHEEL
from autograder.setup.refusals import NO_NETWORK, SetUpError, no_network, refuse_full_disk, tail

PIP_INSTALL = ("install", "--quiet", "--retries=2", "--disable-pip-version-check", "--no-deps", "--require-hashes")


def pin(lock: str, package: str) -> str:
    """Return the lines of `lock` that pin `package`, hashes included.

    Raises SetUpError if there are none.
    """
    text = (ROOT / lock).read_text(encoding="utf-8")
    found = re.search(r"^%s==.*(\n[ \t].*)*" % re.escape(package), text, re.MULTILINE)
    if found is None:
        raise SetUpError("%s does not pin %s." % (lock, package), "Make the locks again: make lock")
    return found.group(0) + "\n"


def settings_for_uv(pip: "List[str]") -> "Dict[str, str]":
    """Return the variables that make uv use the package index and certificates that pip is configured for."""
    text = output_of(*pip, "config", "list")[1] if pip else ""
    configured = dict(re.findall(r"^(?:global|install|:env:)\.([a-z-]+)='(.*)'$", text, re.MULTILINE))
    settings = {"UV_PYTHON_DOWNLOADS": "never"}
    for name, variable in (("index-url", "UV_DEFAULT_INDEX"), ("cert", "SSL_CERT_FILE")):
        if configured.get(name) and variable not in os.environ:
            settings[variable] = configured[name]
    return settings


def fill(pip: "List[str]", lock: str) -> None:
    """Install what `lock` pins: by uv, or by pip where uv does not manage.

    Raises SetUpError if neither manages.
    """
    uv, trouble = str(PYTHON.with_name("uv")), "it could not be installed"
    if pip and not Path(uv).exists():
        pins = VENV / "uv.lock"
        pins.write_text(pin(lock, "uv"), encoding="utf-8")
        status, text = output_of(*pip, *PIP_INSTALL, "-r", str(pins))
        if status and NO_NETWORK.search(text):
            raise no_network(text)
    elif not pip:
        uv = shutil.which("uv") or uv
    if Path(uv).exists():
        # Not `uv pip sync`: it takes the egg-infos that the ROS wheels carry for packages to be removed, files and all.
        options = ("--quiet", "--python", str(PYTHON), "--no-deps", "--require-hashes", "--compile-bytecode")
        status, text = output_of(uv, "pip", "install", *options, "-r", str(ROOT / lock), **settings_for_uv(pip))
        if status == 0:
            return
        refuse_full_disk(text)
        trouble = text.strip()
    if not pip:
        raise SetUpError(
            "This Python has neither ensurepip nor pip, so packages cannot be installed.",
            "Debian, Ubuntu: sudo apt-get install python3-venv",
        )
    say("  uv failed:\n%s\n  pip now does the same, which takes a minute or two" % tail(trouble))
    status, text = output_of(*pip, *PIP_INSTALL, "-r", str(ROOT / lock))
    if status:
        refuse_full_disk(text)
        if NO_NETWORK.search(text):
            raise no_network(text)
        raise SetUpError(
            "The packages could not be installed:\n%s" % tail(text),
            "Look for the reason in these lines, then run the command again.",
        )


def install_wheel(pip: "List[str]") -> None:
    """Install the kit itself from the wheel of a student's kit, in place of an earlier one.

    Raises SetUpError if that fails.
    """
    uv = shutil.which("uv", path=str(PYTHON.parent))
    if uv:
        command = [uv, "pip", "install", "--quiet", "--offline", "--python", str(PYTHON), "--compile-bytecode"]
        status, text = output_of(*command, "--no-deps", "--reinstall", str(ROOT / WHEEL))
    else:
        status, text = output_of(*pip, "install", "--quiet", "--no-deps", "--force-reinstall", str(ROOT / WHEEL))
    if status:
        refuse_full_disk(text)
        raise SetUpError(
            "The kit itself could not be installed:\n%s" % tail(text), "Unpack the kit again, and try again."
        )


def say(text: str) -> None:
    """Tell the person what happens, on standard error."""
    sys.stderr.write(text + "\n")
    sys.stderr.flush()
