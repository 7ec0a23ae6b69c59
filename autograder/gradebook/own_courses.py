"""Makes nbgrader ready in this process: it runs the `nbgrader_config.py` of courses of yours, and no other.

nbgrader reads the configuration of the folder that it is started in, and that is a program. A folder cannot say of
itself that it is a course, because a student could have written that, too. So a list outside of it does, in the user's
own configuration: `autograder new course` and `autograder trust` put folders into it.
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
"""A course's `nbgrader_config.py` as it begins, without settings of its own."""


def _list() -> Path:
    home = os.environ.get("XDG_CONFIG_HOME") or Path.home() / ".config"
    return Path(home, "ros2-course-autograder", "courses")


def trust(folder: Path) -> None:
    """Note that a folder is a course of this user's, whose nbgrader configuration is run.

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
    """Whether a configuration is the user's own: the kit's, or that of a course of the user's.

    One that a new course gets is no exception, because it makes modules of its folder those of the whole process.
    """
    from jupyter_core.paths import jupyter_config_path

    folder = file.resolve().parent
    places = {Path(place).resolve() for place in jupyter_config_path()} | {ROOT.resolve()}
    if folder in places or file.parent.resolve() in places or str(file.parent.resolve()) in _known():
        return True
    try:
        return file.suffix == ".py" and file.read_text(encoding="utf-8") == CLOSED  # which only stops
    except (OSError, UnicodeError):
        return False


def guard_configuration() -> None:
    """Let the Jupyter programs of this process pass over nbgrader configurations that are not the user's own."""
    from traitlets.config import Application
    from traitlets.config.loader import ConfigFileNotFound, JSONFileConfigLoader, PyFileConfigLoader

    class OwnPython(PyFileConfigLoader):  # type: ignore[misc]
        """Reads a configuration that is a program."""

        def load_config(self) -> Any:
            """Read it, if it is the user's own."""
            _refuse(self, ConfigFileNotFound)
            return super().load_config()

    class OwnJson(JSONFileConfigLoader):  # type: ignore[misc]
        """Reads a configuration that is a table: it can name programs, too."""

        def load_config(self) -> Any:
            """Read it, if it is the user's own."""
            _refuse(self, ConfigFileNotFound)
            return super().load_config()

    Application.python_config_loader_class = OwnPython
    Application.json_config_loader_class = OwnJson


_told: set[Path] = set()


def _refuse(loader: Any, refusal: type[Exception]) -> None:
    file = Path(loader.path or os.getcwd(), loader.filename)  # noqa: PTH109  as traitlets looks for it
    if not file.is_file() or may_run(file):
        return
    if file not in _told:
        _told.add(file)
        told = f"{file} is ignored, because it is not known to be yours. If this folder is your course, run:"
        print(f"{told} autograder trust {file.parent}", file=sys.stderr)
    raise refusal(f"{file} is ignored")


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
