"""Prepare nbgrader in this process so that it runs the `nbgrader_config.py` only of the user's own courses.

nbgrader runs the configuration in the folder in which it is started, and this configuration is a program. A file in the
folder cannot show that the folder is the user's own course, because a student could have written that file as well.
Therefore the user's own configuration has a list of courses. `autograder new course` and `autograder trust` add folders
to it.
"""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import Any

from autograder.core.files import write_beside
from autograder.intake.collect import CLOSED
from autograder.setup.places import ROOT

TEMPLATE = Path(__file__).with_name("nbgrader_config.template")
"""The `nbgrader_config.py` of a new course, which contains no settings of the course's own."""


def _list() -> Path:
    home = os.environ.get("XDG_CONFIG_HOME") or Path.home() / ".config"
    return Path(home, "ros2-course-autograder", "courses")


def trust(folder: Path) -> None:
    """Add a folder to the list of the user's own courses, whose nbgrader configuration may be run.

    Raises:
        OSError: the list cannot be written.
    """
    known = _known()
    if str(folder.resolve()) not in known:
        write_beside(_list(), "".join(f"{one}\n" for one in (*known, folder.resolve())))


def _known() -> list[str]:
    try:
        return _list().read_text(encoding="utf-8").splitlines()
    except (OSError, UnicodeError):
        return []


def may_run(file: Path) -> bool:
    """Return whether a configuration may be run: it belongs to the kit, to Jupyter, or to one of the user's courses.

    An unchanged configuration of a new course is no exception, because it adds its folder to the process's import path.
    """
    from jupyter_core.paths import jupyter_config_path

    folder = file.resolve().parent
    places = {Path(place).resolve() for place in jupyter_config_path()} | {ROOT.resolve()}
    if folder in places or file.parent.resolve() in places or str(file.parent.resolve()) in _known():
        return True
    try:
        return file.suffix == ".py" and file.read_text(encoding="utf-8") == CLOSED  # this program only stops nbgrader
    except (OSError, UnicodeError):
        return False


def guard_configuration() -> None:
    """Make the Jupyter programs of this process ignore nbgrader configurations that are not the user's own."""
    from traitlets.config import Application
    from traitlets.config.loader import ConfigFileNotFound, JSONFileConfigLoader, PyFileConfigLoader

    class OwnPython(PyFileConfigLoader):  # type: ignore[misc]
        """Loads a configuration that is a program."""

        def load_config(self) -> Any:
            """Load the configuration if it is the user's own."""
            _refuse(self, ConfigFileNotFound)
            return super().load_config()

    class OwnJson(JSONFileConfigLoader):  # type: ignore[misc]
        """Loads a configuration in JSON, which can also name programs."""

        def load_config(self) -> Any:
            """Load the configuration if it is the user's own."""
            _refuse(self, ConfigFileNotFound)
            return super().load_config()

    Application.python_config_loader_class = OwnPython
    Application.json_config_loader_class = OwnJson


_told: set[Path] = set()


def _refuse(loader: Any, refusal: type[Exception]) -> None:
    file = Path(loader.path or os.getcwd(), loader.filename)  # noqa: PTH109  traitlets finds it in this way
    if not file.is_file() or may_run(file):
        return
    if file not in _told:
        _told.add(file)
        told = f"{file} is ignored, because it is not known to be yours. If this folder is your course, run:"
        print(f"{told} autograder trust {file.parent}", file=sys.stderr)
    raise refusal(f"{file} is ignored")


def prepare_nbgrader() -> None:
    """Prepare nbgrader: make its import faster, guard its configuration, and let it find its database tool."""
    # If this module can be imported, jsonschema builds a grammar for one format of strings, which takes 3 s.
    sys.modules.setdefault("rfc3987_syntax", None)  # type: ignore[arg-type]
    os.environ["TRAITLETS_APPLICATION_RAISE_CONFIG_FILE_ERROR"] = "1"
    from autograder.gradebook.own_courses import guard_configuration

    guard_configuration()
    # nbgrader runs `alembic` by name.
    tools = str(Path(sys.executable).parent)
    if tools not in os.environ.get("PATH", "").split(os.pathsep):
        os.environ["PATH"] = tools + os.pathsep + os.environ.get("PATH", "")
