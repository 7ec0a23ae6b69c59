"""For a whole environment that the kit's wheel was installed into: outside of a course nbgrader executes nothing.

A course's own `nbgrader_config.py`, which nbgrader reads after this one, leads its commands the course's way.
"""

import os
import sys
from pathlib import Path

os.environ["TRAITLETS_APPLICATION_RAISE_CONFIG_FILE_ERROR"] = "1"
try:
    # nbgrader looks for modules in the working folder, which may be a student's.
    sys.path[:] = [folder for folder in sys.path if folder not in ("", str(Path.cwd()))]

    from autograder.gradebook.own_courses import prepare_nbgrader

    prepare_nbgrader()

    from autograder.gradebook.nbgrader_commands import close

    close()
except BaseException as error:
    sys.exit(f"nbgrader_config.py: {type(error).__name__}: {error}. Nothing was executed.")
