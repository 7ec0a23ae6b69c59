# Written for Python 3.6 and up, so that an old Python meets a sentence and not a SyntaxError.
# ruff: noqa: UP031
"""The labs of a student's kit: as they were handed out below `kit/labs`, and below `labs` where the student works."""

import contextlib
import filecmp
import os
import shutil

from autograder.setup.places import KIT_FOLDER, ROOT


def put_labs() -> None:
    """Put each lab that is not there yet where the student works. A lab that is there is the student's, and stays.

    Only `README.md`, the page that lists the labs, is the kit's, and is put in place of an earlier one. Another process
    may do the same meanwhile.

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
            if not (given.is_dir() and mine.exists()):  # of a lab the first one counts
                raise
        finally:
            shutil.rmtree(str(beside), ignore_errors=True)
            with contextlib.suppress(OSError):
                beside.unlink()
