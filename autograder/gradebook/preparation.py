"""What has to be done before nbgrader is imported."""

from __future__ import annotations

import os
import sys
from pathlib import Path


def prepare_nbgrader() -> None:
    """Make nbgrader importable at a bearable price, and able to find its database tool."""
    # Without this module jsonschema does not check one format of strings; with it, building its grammar takes 3 s.
    sys.modules.setdefault("rfc3987_syntax", None)  # type: ignore[arg-type]
    os.environ["TRAITLETS_APPLICATION_RAISE_CONFIG_FILE_ERROR"] = "1"
    from autograder.gradebook.own_courses import guard_configuration

    guard_configuration()
    # nbgrader runs `alembic` by name.
    tools = str(Path(sys.executable).parent)
    if tools not in os.environ.get("PATH", "").split(os.pathsep):
        os.environ["PATH"] = tools + os.pathsep + os.environ.get("PATH", "")
