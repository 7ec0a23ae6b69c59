"""nbgrader's configuration for an environment with the kit's wheel: nbgrader executes nothing outside of a course.

nbgrader reads the `nbgrader_config.py` of a course after this file. That configuration makes nbgrader's commands use
the course's own stages.
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
