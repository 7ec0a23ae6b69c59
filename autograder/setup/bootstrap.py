# Written for Python 3.6 and up, so that an old Python meets a sentence and not a SyntaxError.
# ruff: noqa: UP031
"""Make `.venv` from the hashed lock: the command behind `make setup`, with `--dev` and `--python PYTHON`.

Needs nothing but the standard library. A finished environment carries a marker with the lock's hash, so that a second
run costs one small file. Without a matching marker (interrupted, moved, other Python) it is made anew; with a
finished one and another lock it is brought up to date.

Exit status 0: `.venv` is ready. 2: it is not; standard error says why and what to do.
"""

import argparse
import fcntl
import os
import time

from autograder.setup.commands import write_commands
from autograder.setup.environment import create, digest, discard, finish, read_marker
from autograder.setup.interpreter import find_python
from autograder.setup.jupyter import lead_jupyter
from autograder.setup.labs import put_labs
from autograder.setup.packages import fill, install_wheel, say
from autograder.setup.places import DEV_LOCK, MARKER, PYTHON, ROOT, STUDENT_LOCK, VENV, WHEEL
from autograder.setup.python import lead_python
from autograder.setup.refusals import SetUpError, refuse_closed_folder, refuse_foreign_ros, refuse_other_machines


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
    sources = locks + [WHEEL] if WHEEL else locks  # noqa: RUF005  Python 3.6 is to understand it
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
    """Run the command; return its exit status."""
    parser = argparse.ArgumentParser(prog="make setup", description="Create .venv from the hashed lock.")
    parser.add_argument("--dev", action="store_true", help="also install what tests and lectures need")
    parser.add_argument("--python", default="", help="the Python to build on, instead of the first good one on PATH")
    options = parser.parse_args()
    failed = ".venv could not be created"
    try:
        # Two commands in two terminals must not make one environment at once. The checkout itself is the lock.
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
