"""nbgrader's configuration for the environment of a student's kit: Validate shows what `autograder check` shows."""

import os
import sys
from pathlib import Path

os.environ["TRAITLETS_APPLICATION_RAISE_CONFIG_FILE_ERROR"] = "1"
try:
    # nbgrader looks for modules in the working folder, which may hold anything.
    sys.path[:] = [folder for folder in sys.path if folder not in ("", str(Path.cwd()))]

    from autograder.grading.nbgrader_validate import use_own_course

    use_own_course(get_config())  # type: ignore[name-defined]  # noqa: F821  traitlets provides get_config
except BaseException as error:
    sys.exit(f"nbgrader_config.py: {type(error).__name__}: {error}. Nothing was executed.")
