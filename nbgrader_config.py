"""nbgrader's configuration of this course: the same stages as `autograder grade`, and no others.

nbgrader goes on with its own stages, which run students' code, when a configuration cannot be loaded. So whatever goes
wrong here ends the command. Settings of your own stand at the end, such as the penalties for who is late.
"""

import os
import sys
from pathlib import Path

os.environ["TRAITLETS_APPLICATION_RAISE_CONFIG_FILE_ERROR"] = "1"
try:
    _ROOT = Path(__file__).resolve().parent
    # nbgrader looks for modules in the working folder, which may be a student's.
    sys.path[:] = [str(_ROOT), *(folder for folder in sys.path if folder not in ("", str(Path.cwd()), str(_ROOT)))]

    from autograder.gradebook.own_courses import prepare_nbgrader

    prepare_nbgrader()

    from autograder.gradebook.nbgrader_commands import take_over

    take_over(get_config(), _ROOT)  # noqa: F821  traitlets provides get_config
except BaseException as error:
    sys.exit(f"nbgrader_config.py: {type(error).__name__}: {error}. Nothing was executed.")
