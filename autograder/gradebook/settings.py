"""Read nbgrader's settings for a course: the kit's settings, and those in the course's own `nbgrader_config.py`."""

from __future__ import annotations

import sys
from functools import cache
from pathlib import Path
from typing import Any

from autograder.core.errors import KitError
from autograder.course.paths import CoursePaths
from autograder.gradebook.backup import file_of
from autograder.gradebook.own_courses import TEMPLATE, may_run

CONFIG_FILE = "nbgrader_config.py"
_KIT = str(Path(__file__).resolve().parents[2])


@cache
def settings_of(root: Path) -> Any:
    """Return nbgrader's complete configuration for a course. It is read once per process.

    Raises:
        KitError: the course's `nbgrader_config.py` cannot be used.
    """
    from autograder.gradebook.own_courses import prepare_nbgrader

    prepare_nbgrader()
    from traitlets.config import Config
    from traitlets.config.loader import PyFileConfigLoader

    from autograder.gradebook.config import configure

    config = Config()
    configure(config, root)
    if _says_more(root):
        before = sys.path[:]
        try:
            config.merge(PyFileConfigLoader(CONFIG_FILE, str(root)).load_config())
        except (Exception, SystemExit) as error:
            raise KitError(
                f"{root / CONFIG_FILE} cannot be used: {error}", "Correct the line that the error names."
            ) from error
        finally:  # the configuration removes the working folder, from which the kit may have been imported
            sys.path += [folder for folder in before if folder == _KIT and folder not in sys.path]
    return config


def gradebook_address(root: Path) -> str:
    """Return the address of a course's gradebook in the form that SQLAlchemy expects.

    Raises:
        KitError: the course's configuration cannot be used, or its address is not valid or needs a missing driver.
    """
    # Loading nbgrader takes a second. If the course has no settings of its own, the address is known without it.
    if not _says_more(root):
        return CoursePaths(root).gradebook_url
    return _usable(str(settings_of(root).CourseDirectory.db_url), root / CONFIG_FILE)


@cache
def _usable(address: str, config: Path) -> str:
    """Return an address after checking that it is valid and that its driver is installed.

    Raises:
        KitError: the address is not valid, or its driver is not installed.
    """
    from sqlalchemy.engine import make_url
    from sqlalchemy.exc import SQLAlchemyError

    try:
        make_url(address).get_dialect().import_dbapi()
    except SQLAlchemyError as error:
        raise KitError(
            f"{config} sets `CourseDirectory.db_url` to a text that is not the address of a gradebook: {error}",
            "Such addresses are sqlite:////home/me/gradebook.db and postgresql+psycopg://grader@dbhost/gradebook.",
        ) from error
    except ImportError as error:
        raise KitError(
            f"{config} sets `CourseDirectory.db_url` to a database whose driver is not installed: {error}.",
            'Install it. For postgresql+psycopg://… the command is: pip install "psycopg[binary]"',
        ) from error
    return address


def gradebook_file(root: Path) -> Path | None:
    """Return the file of a course's gradebook; None if the gradebook is on a server."""
    return file_of(gradebook_address(root))


def gradebook_place(root: Path) -> str:
    """Return the place of a course's gradebook for a message, without the password of a server."""
    file = gradebook_file(root)
    if file is not None:
        return str(file)
    from sqlalchemy.engine import make_url

    return make_url(gradebook_address(root)).render_as_string(hide_password=True)


def _says_more(root: Path) -> bool:
    """Return whether a course has nbgrader settings of its own.

    Raises:
        KitError: the course has such settings, but they may be a program from somebody else.
    """
    own = root / CONFIG_FILE
    if not own.is_file() or own.read_text(encoding="utf-8", errors="replace") == TEMPLATE.read_text(encoding="utf-8"):
        return False
    if not may_run(own):
        raise KitError(
            f"{own} is a program that is not known to be yours, so it was not run.",
            f"If this folder is your course, and not something that was handed in, run once: autograder trust {root}",
        )
    return True
