# This file runs in Python 3.6 and newer, so that an old Python prints a message and not a SyntaxError.
# ruff: noqa: UP006, UP031, UP035
"""Create `.venv` from the hashed lock. This is the command behind `make setup`, with `--dev` and `--python PYTHON`.

It needs only the standard library. A finished environment contains a marker with the lock's hash, so that a second run
only has to read one small file. If there is no valid marker, because set-up was interrupted or because the environment
was moved or has lost its Python, the environment is created again. If the lock has changed, it is updated.

The exit status is 0 if `.venv` is ready, and 2 if it is not; standard error then says why and what to do.
"""

import argparse
import fcntl
import os
import re
import shutil
import sys
import time
from pathlib import Path
from typing import Dict, List

from autograder.setup.environment import (
    create,
    digest,
    discard,
    finish,
    lead_jupyter,
    lead_python,
    read_marker,
    write_commands,
)
from autograder.setup.interpreter import find_python, output_of
from autograder.setup.labs import put_labs
from autograder.setup.places import DEV_LOCK, MARKER, PYTHON, ROOT, STUDENT_LOCK, VENV, WHEEL
from autograder.setup.refusals import (
    NO_NETWORK,
    SetUpError,
    no_network,
    refuse_closed_folder,
    refuse_foreign_ros,
    refuse_full_disk,
    refuse_other_machines,
    tail,
)

PIP_INSTALL = ("install", "--quiet", "--retries=2", "--disable-pip-version-check", "--no-deps", "--require-hashes")


def pin(lock: str, package: str) -> str:
    """Return the lines of `lock` that pin `package`, including its hashes.

    Raises SetUpError if there are no such lines.
    """
    text = (ROOT / lock).read_text(encoding="utf-8")
    found = re.search(r"^%s==.*(\n[ \t].*)*" % re.escape(package), text, re.MULTILINE)
    if found is None:
        raise SetUpError("%s does not pin %s." % (lock, package), "Make the locks again: make lock")
    return found.group(0) + "\n"


def settings_for_uv(pip: "List[str]") -> "Dict[str, str]":
    """Return the variables that make uv use the same package index and certificates as pip is configured to use."""
    text = output_of(*pip, "config", "list")[1] if pip else ""
    configured = dict(re.findall(r"^(?:global|install|:env:)\.([a-z-]+)='(.*)'$", text, re.MULTILINE))
    settings = {"UV_PYTHON_DOWNLOADS": "never"}
    for name, variable in (("index-url", "UV_DEFAULT_INDEX"), ("cert", "SSL_CERT_FILE")):
        if configured.get(name) and variable not in os.environ:
            settings[variable] = configured[name]
    return settings


def fill(pip: "List[str]", lock: str) -> None:
    """Install the packages that `lock` pins, with uv or, if uv fails, with pip.

    Raises SetUpError if both fail.
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
        # `uv pip sync` cannot be used, because it would treat the egg-infos in the ROS wheels as packages to remove.
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
    """Install the kit itself from the wheel in a student's kit, and replace an earlier version.

    Raises SetUpError if this fails.
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
    """Print a text for the person on standard error."""
    sys.stderr.write(text + "\n")
    sys.stderr.flush()


def make_ready(dev: bool, wanted: str) -> None:
    """Make `.venv` match the lock. Do almost nothing if it already does.

    Raises SetUpError if this machine or Python cannot be used, or OSError if files cannot be written.
    """
    refuse_foreign_ros(os.environ)
    state = read_marker()
    base = find_python(wanted) if wanted else None
    if base and state and tuple(state["version"])[:2] != base.version[:2]:
        state = {}
    known = state.get("locks", {})
    # The packages for tests and lectures include all others. An environment that has them once keeps them.
    locks = [STUDENT_LOCK, DEV_LOCK] if dev or DEV_LOCK in known else [STUDENT_LOCK]
    sources = locks + [WHEEL] if WHEEL else locks  # noqa: RUF005  for Python 3.6
    if all(known.get(source) == digest(source) for source in sources):
        lead_python()
        write_commands()
        lead_jupyter()
        return
    refuse_other_machines()
    refuse_closed_folder(VENV if state else ROOT)
    started = time.time()
    if state:
        say("Bringing .venv up to date with %s" % locks[-1])
        version = tuple(state["version"])
        MARKER.unlink()
        pip = [str(PYTHON), "-m", "pip"]
    else:
        base = base or find_python("")
        version = base.version
        say("Creating .venv%s (once, about a minute)" % (" again" if VENV.exists() else ""))
        say("  Python %d.%d.%d: %s" % (version[0], version[1], version[2], base.program))
        discard()
        pip = create(base)
    fill(pip, locks[-1])
    if WHEEL:
        install_wheel(pip)
    finish(sources, version)
    say("  ready in %.0f s" % (time.time() - started))


def main() -> int:
    """Run the command and return its exit status."""
    parser = argparse.ArgumentParser(prog="make setup", description="Create .venv from the hashed lock.")
    parser.add_argument("--dev", action="store_true", help="also install what tests and lectures need")
    parser.add_argument("--python", default="", help="the Python to build on, instead of the first good one on PATH")
    options = parser.parse_args()
    failed = ".venv could not be created"
    try:
        # Two commands in two terminals must not create the environment at the same time. The folder itself is locked.
        fcntl.flock(os.open(str(ROOT), os.O_RDONLY), fcntl.LOCK_EX)
        make_ready(options.dev, options.python)
        if WHEEL:
            failed = ".venv is ready, but the labs could not be put into %s" % (ROOT / "labs")
            put_labs()
    except SetUpError as error:
        say("\n%s\n\nWhat to do: %s" % (error.what, error.do))
    except OSError as error:
        say("\n%s: %s\n\nWhat to do: make sure that the folder is yours and that the disk has space." % (failed, error))
    except KeyboardInterrupt:
        say("\nInterrupted. The next run starts over.")
    else:
        return 0
    return 2
