"""Run a command and turn its errors into sentences. The exit status 2 means an error of usage or set-up.

Most imports are inside the commands, so that `autograder check` starts quickly.
"""

from __future__ import annotations

import os
import sys
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path

from autograder.cli import appeal, check, machine, package, submit, world  # noqa: F401  each registers its commands
from autograder.cli.app import app
from autograder.core.errors import GRADEBOOK_REFUSED, KitError
from autograder.setup.refusals import SetUpError, refuse_foreign_ros

if find_spec("autograder.cli.instructors"):  # a student's kit does not have this module
    import_module("autograder.cli.instructors")

INTERRUPTED = 130
"""The exit status after Ctrl-C. Typer catches KeyboardInterrupt and exits with this status without a message."""


def main() -> None:
    """Run the command. Errors are printed as sentences, never as a traceback."""
    try:
        if sys.argv[1:2] != ["doctor"]:  # `doctor` reports a foreign ROS itself
            refuse_foreign_ros(os.environ)
        app()
    except (KitError, SetUpError) as error:
        from autograder.report.terminal import plain  # the message may contain a file name that a student chose

        print(plain(f"error: {error.what}"), file=sys.stderr)
        if error.do:
            print(plain(f"  {error.do}"), file=sys.stderr)
        sys.exit(2)
    except (KeyboardInterrupt, SystemExit) as end:
        if isinstance(end, SystemExit) and end.code != INTERRUPTED:
            raise
        print("\nInterrupted.", file=sys.stderr)
        sys.exit(INTERRUPTED)
    except BrokenPipeError:
        sys.exit(1)
    except OSError as error:  # the machine refused something, so this is not a defect of the kit
        print(f"error: {error.filename or 'a file'}: {error.strerror or error}", file=sys.stderr)
        print(
            "  Make sure that its folder exists, that you may write there, and that the disk has space.\n"
            '  To take over files that another user left in the course\'s folder, run: sudo chown -R "$USER" build\n'
            '  Two users share a course through a group: see "Two people grade" in the instructors\' pages.',
            file=sys.stderr,
        )
        sys.exit(2)
    except Exception as error:
        if type(error).__name__ == "OperationalError":  # the error of sqlite3, or that of SQLAlchemy which wraps it
            print(f"error: The gradebook cannot be used: {getattr(error, 'orig', error)}.", file=sys.stderr)
            print(f"  {GRADEBOOK_REFUSED}", file=sys.stderr)
            sys.exit(2)
        if (
            type(error).__name__ == "DatabaseError"
        ):  # where the gradebook's path is known, `damage_told` has already made a sentence with it
            print(f"error: The gradebook is damaged: {getattr(error, 'orig', error)}.", file=sys.stderr)
            print("  Replace it with a copy: earlier copies are in gradebook/backups.", file=sys.stderr)
            sys.exit(2)
        import traceback

        last = traceback.extract_tb(error.__traceback__)[-1]
        print(f"error: {type(error).__name__}: {error}", file=sys.stderr)
        print(f"  This is a defect of the kit ({Path(last.filename).name}:{last.lineno}).", file=sys.stderr)
        sys.exit(2)
