"""nbgrader's settings of a course: the kit's, and over them what the course's own `nbgrader_config.py` says."""

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
    """Return nbgrader's whole configuration of a course, read once per process.

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
        finally:  # it takes the working folder out, which may be the one that the kit is imported from
            sys.path += [folder for folder in before if folder == _KIT and folder not in sys.path]
    return config


def gradebook_address(root: Path) -> str:
    """Return the address of a course's gradebook, as SQLAlchemy wants it.

    Raises:
        KitError: the course names none, or one that this environment cannot reach.
    """
    # Loading nbgrader takes a second; where the course says nothing of its own, the address is known without.
    if not _says_more(root):
        return CoursePaths(root).gradebook_url
    return _usable(str(settings_of(root).CourseDirectory.db_url), root / CONFIG_FILE)


@cache
def _usable(address: str, config: Path) -> str:
    """Return an address for which there is a driver."""
    from sqlalchemy.engine import make_url
    from sqlalchemy.exc import SQLAlchemyError

    try:
        make_url(address).get_dialect().import_dbapi()
    except SQLAlchemyError as error:
        raise KitError(
            f"{config} sets `CourseDirectory.db_url` to what is no address of a gradebook: {error}",
            "Such addresses are sqlite:////home/me/gradebook.db and postgresql+psycopg://grader@dbhost/gradebook.",
        ) from error
    except ImportError as error:
        raise KitError(
            f"{config} sets `CourseDirectory.db_url` to a database whose driver is not installed: {error}.",
            'Install it; for postgresql+psycopg://… that is: pip install "psycopg[binary]"',
        ) from error
    return address


def gradebook_file(root: Path) -> Path | None:
    """Return the file that is a course's gradebook; None where it lies on a server."""
    return file_of(gradebook_address(root))


def gradebook_place(root: Path) -> str:
    """Return where a course's gradebook lies, for a person to read: without a password."""
    file = gradebook_file(root)
    if file is not None:
        return str(file)
    from sqlalchemy.engine import make_url

    return make_url(gradebook_address(root)).render_as_string(hide_password=True)


def _says_more(root: Path) -> bool:
    """Whether a course has settings of its own.

    Raises:
        KitError: it has, and they may be a program of somebody else's.
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
