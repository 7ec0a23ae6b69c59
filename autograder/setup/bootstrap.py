# Written for Python 3.6 and up, so that an old Python meets a sentence and not a SyntaxError.
# ruff: noqa: UP006, UP031, UP035, UP045
"""Make `.venv` from the hashed lock: `python3 -I autograder/setup/bootstrap.py [--dev] [--python PYTHON]`.

Needs nothing but the standard library. A finished environment carries a marker with the lock's hash, so that a second
run costs one small file. Without a matching marker (interrupted, moved, other Python) it is made anew; with a
finished one and another lock it is brought up to date.

Exit status 0: `.venv` is ready. 2: it is not; standard error says why and what to do.
"""

import argparse
import contextlib
import fcntl
import hashlib
import json
import os
import platform
import re
import shutil
import subprocess
import sys
import time
from pathlib import Path
from typing import Any, Dict, List, Mapping, NamedTuple, Optional, Tuple

ROOT = Path(__file__).resolve().parent.parent.parent
VENV = ROOT / ".venv"
PYTHON = VENV / "bin" / "python"
MARKER = VENV / "autograder-ready.json"
STUDENT_LOCK, DEV_LOCK = "requirements.lock", "requirements-dev.lock"
OLDEST, NEWEST = (3, 11), (3, 14)
ROS_DISTRIBUTION = "jazzy"
ROS_PATHS = ("PYTHONPATH", "AMENT_PREFIX_PATH", "COLCON_PREFIX_PATH", "CMAKE_PREFIX_PATH", "LD_LIBRARY_PATH")
NO_NETWORK = re.compile(
    r"NewConnectionError|ConnectTimeout|ConnectionError|ReadTimeout|NameResolutionError|Temporary failure in name"
    r"|Network is unreachable|No route to host|Connection refused|ProxyError|dns error|error sending request"
    r"|tcp connect error",
    re.IGNORECASE,
)
NO_SPACE = re.compile(r"No space left on device|Disk quota exceeded", re.IGNORECASE)
FULL_DISK = 16 << 20  # bytes
PIP_INSTALL = ("install", "--quiet", "--retries=2", "--disable-pip-version-check", "--no-deps", "--require-hashes")
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


class SetUpError(Exception):
    """What is in the way, and what to do about it, each for a person to read."""

    def __init__(self, what: str, do: str) -> None:
        """Keep what happened and what to do."""
        super().__init__(what)
        self.what = what
        self.do = do


class Interpreter(NamedTuple):
    """A Python that `.venv` can be built on."""

    program: str
    version: Tuple[int, ...]
    ensurepip: bool
    pip: bool


def foreign_ros(environ: Mapping[str, str]) -> str:
    """Return where a sourced ROS distribution other than Jazzy shows in `environ`; empty if nowhere."""
    for name in ROS_PATHS:
        for found in re.finditer(r"/opt/ros/([a-z]+)", environ.get(name, "")):
            if found.group(1) != ROS_DISTRIBUTION:
                return "%s names %s" % (name, found.group(0))
    distribution = environ.get("ROS_DISTRO", ROS_DISTRIBUTION)
    return "" if distribution == ROS_DISTRIBUTION else "ROS_DISTRO is %s" % distribution


def refuse_foreign_ros(environ: Mapping[str, str]) -> None:
    """Raise SetUpError if another ROS distribution is sourced: its rclpy would be imported instead of ours."""
    where = foreign_ros(environ)
    if where:
        unset = " ".join("-u " + name for name in (*ROS_PATHS, "ROS_DISTRO") if name in environ)
        raise SetUpError(
            "Another ROS distribution is sourced in this shell: %s. This course runs on ROS 2 Jazzy." % where,
            "Open a terminal that does not source it (look for /opt/ros in ~/.bashrc), or run once with\n"
            "  env %s make ..." % unset,
        )


def refuse_other_machines() -> None:
    """Raise SetUpError where the ROS 2 wheels do not run: they are for Linux on x86_64 with glibc 2.28 or newer."""
    library, version = platform.libc_ver()
    if not sys.platform.startswith("linux") or platform.machine() not in ("x86_64", "AMD64"):
        found = "this is %s on %s" % (platform.system(), platform.machine())
    elif library != "glibc":
        found = "the C library here is not glibc"
    elif tuple(int(part) for part in version.split(".")[:2]) < (2, 28):
        found = "here is glibc %s" % version
    else:
        return
    raise SetUpError(
        "The ROS 2 packages exist for Linux on x86_64 with glibc 2.28 or newer; %s." % found,
        "Use such a machine, WSL 2 on Windows, or the container described in .devcontainer.",
    )


def refuse_closed_folder(folder: Path) -> None:
    """Raise SetUpError if this user may not write to `folder`."""
    if not os.access(str(folder), os.W_OK):
        raise SetUpError(
            "This user may not write to %s." % folder,
            "Work in a copy that is yours, or make it yours: sudo chown -R \"$USER\" '%s'" % ROOT,
        )


def refuse_full_disk(text: str) -> None:
    """Raise SetUpError if a command failed because the disk is full: its output or the disk says so."""
    if NO_SPACE.search(text) or shutil.disk_usage(str(ROOT)).free < FULL_DISK:  # venv keeps what ensurepip said
        raise SetUpError(
            "There is no space left:\n%s" % tail(text),
            "Free 1.5 GB (df -h says where space is lacking), then run it again.",
        )


def clean_environment() -> "Dict[str, str]":
    """Return this process's environment without what would lead another Python or pip astray."""
    unwanted = ("PYTHONPATH", "PYTHONHOME", "PYTHONSTARTUP", "VIRTUAL_ENV", "PIP_TARGET", "PIP_PREFIX", "PIP_USER")
    return {name: value for name, value in os.environ.items() if name not in unwanted}


def output_of(*command: str, **environ: str) -> "Tuple[int, str]":
    """Run `command` with `environ` added to a clean environment; return its exit status and all that it printed."""
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
    """Ask `program` what Python it is; return why it will not do (empty if it will) and the Interpreter."""
    status, text = output_of(program, "-I", "-c", PROBE)
    try:
        answer = json.loads(text.strip().splitlines()[-1]) if status == 0 else {}
    except (ValueError, IndexError):
        answer = {}
    if not answer:
        return "does not run", None  # pyenv puts stand-ins on PATH that only say that the version is not chosen
    version = tuple(answer["version"])
    if not OLDEST <= version[:2] <= NEWEST:
        return "is Python %d.%d.%d" % version, None
    if answer["build"] != "CPython64":
        return "is a build of the kind %s, not CPython64" % answer["build"], None
    if not answer["venv"]:
        return "has no module venv", None
    return "", Interpreter(answer["program"], version, answer["ensurepip"], answer["pip"])


def find_python(wanted: str) -> Interpreter:
    """Return the Python to build on: `wanted` if it is named, else the first good one on PATH.

    Raises SetUpError if there is none.
    """
    names = [wanted] if wanted else ["python3"] + ["python3.%d" % n for n in range(NEWEST[1], OLDEST[1] - 1, -1)]
    own = str(VENV / "bin")  # the environment may be active in this shell, but it cannot be built on itself
    path = os.pathsep.join(folder for folder in os.get_exec_path() if folder != own)
    refused = []  # type: List[str]
    without_ensurepip = None
    for name in names:
        program = shutil.which(str(Path(name).expanduser()), path=path)
        if program is None:
            refused += ["%s is not there" % name] if wanted else []
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
        "The kit needs Python %d.%d to %d.%d, and found none:\n  " % (OLDEST + NEWEST)
        + ("\n  ".join(refused) or "no python3 on PATH"),
        "Install one (Debian, Ubuntu: sudo apt-get install python3 python3-venv), or name one:\n"
        "  make grade PYTHON=/path/to/python3.12",
    )


def digest(lock: str) -> str:
    """Return the SHA-256 of the lock file `lock`."""
    return hashlib.sha256((ROOT / lock).read_bytes()).hexdigest()


def read_marker() -> "Dict[str, Any]":
    """Return what the finished `.venv` was made of; empty if it is unfinished, moved, or lost its Python."""
    try:
        state = json.loads(MARKER.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}
    whole = state["folder"] == str(VENV) and state["program"] == str(PYTHON.resolve())
    return state if whole and os.access(str(PYTHON), os.X_OK) else {}


def finish(locks: "List[str]", version: "Tuple[int, ...]") -> None:
    """Make the kit importable from the checkout, then write the marker as the very last act.

    Raises SetUpError if the new Python does not run.
    """
    status, text = output_of(str(PYTHON), "-I", "-c", "import sysconfig; print(sysconfig.get_path('purelib'))")
    if status:
        raise SetUpError("The new Python does not run:\n%s" % tail(text), "rm -rf .venv, then try again.")
    Path(text.strip(), "autograder.pth").write_text("%s\n" % ROOT, encoding="utf-8")
    command = PYTHON.with_name("autograder")
    command.write_text(
        # A #! line can hold no space and is cut at 127 bytes: /bin/sh starts the Python that lies beside this file.
        '#!/bin/sh\n\'\'\'exec\' "$(dirname "$(readlink -f "$0")")/python" "$0" "$@"\n\' \'\'\'\n'
        # Guarded, since processes of a pool import the main script once more.
        "import sys\n\nfrom autograder.cli import main\n\nif __name__ == '__main__':\n    sys.exit(main())\n",
        encoding="utf-8",
    )
    command.chmod(0o755)
    lead_jupyter()
    write_marker(locks, version)


def lead_jupyter() -> None:
    """Let nbgrader, nbconvert and kernels of this environment use the course's configuration, wherever they start.

    Started elsewhere than in the course, nbgrader would go on with its own stages, which run what students wrote.
    nbconvert would write reports into Markdown as HTML, though they have a plain text. Kernels would not know what to
    say when a notebook's first cell was not run.
    """
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


def tail(text: str) -> str:
    """Return the last lines of a failed command's output, indented."""
    return "\n".join("  " + line for line in text.strip().splitlines()[-12:])


def pin(lock: str, package: str) -> str:
    """Return the lines of `lock` that pin `package`, hashes included.

    Raises SetUpError if there are none.
    """
    text = (ROOT / lock).read_text(encoding="utf-8")
    found = re.search(r"^%s==.*(\n[ \t].*)*" % re.escape(package), text, re.MULTILINE)
    if found is None:
        raise SetUpError("%s does not pin %s." % (lock, package), "Make the locks anew: make lock")
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
    say("  uv does not manage:\n%s\n  pip does the same in a minute or two" % tail(trouble))
    status, text = output_of(*pip, *PIP_INSTALL, "-r", str(ROOT / lock))
    if status:
        refuse_full_disk(text)
        if NO_NETWORK.search(text):
            raise no_network(text)
        raise SetUpError(
            "The packages could not be installed:\n%s" % tail(text),
            "Look for the reason in these lines, then run it again.",
        )


def no_network(text: str) -> SetUpError:
    """Return the error for a package index that cannot be reached."""
    return SetUpError(
        "The packages cannot be downloaded: the Python package index does not answer.\n%s" % tail(text),
        "Connect to the network and run it again. Behind a proxy set HTTPS_PROXY; for a mirror set PIP_INDEX_URL.",
    )


def say(text: str) -> None:
    """Tell the person what happens, on standard error."""
    sys.stderr.write(text + "\n")
    sys.stderr.flush()


def make_ready(dev: bool, wanted: str) -> None:
    """Bring `.venv` to the state that the lock describes; do nothing if it is there already.

    Raises SetUpError, or OSError if files cannot be written.
    """
    refuse_foreign_ros(os.environ)
    state = read_marker()
    base = find_python(wanted) if wanted else None
    if base and state and tuple(state["version"])[:2] != base.version[:2]:
        state = {}
    known = state.get("locks", {})
    # What tests and lectures need is a superset, so that one environment serves both, and stays so once it is.
    locks = [STUDENT_LOCK, DEV_LOCK] if dev or DEV_LOCK in known else [STUDENT_LOCK]
    if all(known.get(lock) == digest(lock) for lock in locks):
        lead_jupyter()
        return
    refuse_other_machines()
    refuse_closed_folder(VENV if state else ROOT)
    started = time.time()
    if state:
        say("Bringing .venv up to date with %s" % locks[-1])
        version = tuple(state["version"])
        MARKER.unlink()
        fill([str(PYTHON), "-m", "pip"], locks[-1])
    else:
        base = base or find_python("")
        version = base.version
        say("Making .venv%s (once, about a minute)" % (" anew" if VENV.exists() else ""))
        say("  Python %d.%d.%d: %s" % (version[0], version[1], version[2], base.program))
        discard()
        fill(create(base), locks[-1])
    finish(locks, version)
    say("  ready in %.0f s" % (time.time() - started))


def main() -> int:
    """Run the command; return its exit status."""
    parser = argparse.ArgumentParser(description="Make .venv from the hashed lock.")
    parser.add_argument("--dev", action="store_true", help="with what tests and lectures need")
    parser.add_argument("--python", default="", help="the Python to build on, instead of the first good one on PATH")
    options = parser.parse_args()
    try:
        # Two commands in two terminals must not make one environment at once. The checkout itself is the lock.
        fcntl.flock(os.open(str(ROOT), os.O_RDONLY), fcntl.LOCK_EX)
        make_ready(options.dev, options.python)
    except SetUpError as error:
        say("\n%s\n\nWhat to do: %s" % (error.what, error.do))
    except OSError as error:
        say("\n.venv could not be made: %s\n\nWhat to do: see that the folder is yours and the disk has room." % error)
    except KeyboardInterrupt:
        say("\nInterrupted. The next run starts over.")
    else:
        return 0
    return 2


if __name__ == "__main__":
    sys.exit(main())
