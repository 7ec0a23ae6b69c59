# This file runs in Python 3.6 and newer, so that an old Python prints a message and not a SyntaxError.
# ruff: noqa: UP031
"""Copy the labs of a student's kit from `kit/labs`, as they were handed out, to `labs`, where the student works."""

import contextlib
import filecmp
import os
import shutil

from autograder.setup.places import KIT_FOLDER, ROOT


def put_labs() -> None:
    """Copy each lab that does not exist there yet to the folder in which the student works. Keep existing labs.

    Only `README.md`, the page that lists the labs, belongs to the kit and is replaced. Another process may do the same
    at the same time.

    Raises OSError if files cannot be written.
    """
    handed_out, labs = ROOT / KIT_FOLDER / "labs", ROOT / "labs"
    labs.mkdir(exist_ok=True)
    for given in sorted(handed_out.iterdir()):
        mine, beside = labs / given.name, labs / (".%s.%d.new" % (given.name, os.getpid()))
        if mine.exists() and (given.is_dir() or filecmp.cmp(str(given), str(mine), shallow=False)):
            continue
        try:
            if given.is_dir():
                shutil.copytree(str(given), str(beside))
            else:
                shutil.copy(str(given), str(beside))
            beside.replace(mine)
        except OSError:
            if not (given.is_dir() and mine.exists()):  # otherwise another process was faster, and its copy counts
                raise
        finally:
            shutil.rmtree(str(beside), ignore_errors=True)
            with contextlib.suppress(OSError):
                beside.unlink()
