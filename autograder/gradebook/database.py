"""Make sure that the gradebook's database can be written and has the tables of the installed nbgrader."""

from __future__ import annotations

import contextlib
import os
import sqlite3
from collections.abc import Iterator
from pathlib import Path

from autograder.core.errors import KitError
from autograder.course.paths import CoursePaths
from autograder.gradebook.backup import BACKUPS, back_up
from autograder.gradebook.own_courses import prepare_nbgrader
from autograder.gradebook.own_tables import make_indexes
from autograder.gradebook.queries import engine_of
from autograder.gradebook.settings import gradebook_address, gradebook_file, gradebook_place


def make_folder(root: Path) -> None:
    """Create the folder of a course's gradebook, and move a gradebook there from the folder that earlier versions used.

    Raises:
        OSError: the folder cannot be written.
    """
    file = CoursePaths(root).gradebook
    file.parent.mkdir(exist_ok=True)
    earlier = CoursePaths(root).build / file.name
    if earlier.is_file() and not file.exists():
        earlier.replace(file)


def make_usable(root: Path) -> None:
    """Make sure that a course has a gradebook that can be written and has the tables of the installed nbgrader.

    Raises:
        KitError: the gradebook is damaged or cannot be upgraded.
        OSError, sqlite3.OperationalError: the gradebook cannot be written.
    """
    make_folder(root)
    with damage_told(root):
        _refuse_unwritable(root)
        _create(root)
        bring_up_to_date(root)
        name_course(root)
        _add_indexes(root)


@contextlib.contextmanager
def damage_told(root: Path) -> Iterator[None]:
    """Turn the error of a damaged gradebook into a sentence that says what to do.

    Raises:
        KitError: the gradebook is damaged.
    """
    try:
        yield
    except Exception as error:  # SQLAlchemy wraps the error of the database
        inner = getattr(error, "orig", error)
        if type(inner) is not sqlite3.DatabaseError:
            raise
        file = gradebook_file(root)
        assert file is not None
        raise KitError(
            f"The gradebook {file} is damaged: {inner}.",
            f"Replace it with one of the earlier copies in {file.parent / BACKUPS}. If there is none, move it away;"
            " a new one does not contain the points that people gave.",
        ) from error


def _refuse_unwritable(root: Path) -> None:
    file = gradebook_file(root)
    if file is not None and file.is_file():
        with contextlib.closing(sqlite3.connect(file, isolation_level=None)) as connection:
            connection.execute("BEGIN IMMEDIATE")
            connection.execute("ROLLBACK")


def _create(root: Path) -> None:
    """Create the gradebook if there is none, completely or not at all, because the disk may become full meanwhile."""
    file = gradebook_file(root)
    if file is None or (file.is_file() and file.stat().st_size):
        return
    prepare_nbgrader()
    from nbgrader.api import Gradebook

    from autograder.gradebook.private_nbgrader import know_version_of_tables

    know_version_of_tables()
    file.parent.mkdir(parents=True, exist_ok=True)
    beside = file.with_name(f".{file.name}.{os.getpid()}")
    try:
        beside.touch()  # SQLite itself gives nobody else the right to write, whatever the umask of two graders says
        with Gradebook(f"sqlite:///{beside}", course_id=""):
            pass
        beside.replace(file)
    finally:
        for end in ("", "-journal"):
            Path(f"{beside}{end}").unlink(missing_ok=True)


def name_course(root: Path) -> None:
    """Add the course with an empty name to a gradebook on a server.

    A server refuses a lab whose course is not in its table of courses. nbgrader adds only courses that have a name,
    which is enough for a gradebook in a file, because SQLite does not check such references.
    """
    if gradebook_file(root) is not None:
        return
    prepare_nbgrader()
    from nbgrader.api import Course, Gradebook

    with Gradebook(gradebook_address(root)) as gradebook:
        if gradebook.db.get(Course, "") is None:
            gradebook.db.add(Course(id=""))
            gradebook.db.commit()


def _add_indexes(root: Path) -> None:
    from sqlalchemy import inspect

    engine = engine_of(gradebook_address(root))
    try:
        with engine.begin() as connection:
            if inspect(connection).has_table("grade"):
                make_indexes(connection)
    finally:
        engine.dispose()


def bring_up_to_date(root: Path) -> None:
    """Make a copy of a gradebook that an older nbgrader created, and upgrade its tables to the installed version.

    Raises:
        KitError: the upgrade failed, the gradebook does not say its version, or a newer nbgrader created it.
    """
    from sqlalchemy import create_engine, inspect, text

    address = gradebook_address(root)
    engine = create_engine(address)
    try:
        if "alembic_version" not in inspect(engine).get_table_names():
            return
        with engine.connect() as connection:
            version = connection.execute(text("SELECT version_num FROM alembic_version")).scalar()
    finally:
        engine.dispose()
    prepare_nbgrader()
    from alembic.script import ScriptDirectory
    from nbgrader.dbutil import ALEMBIC_DIR, upgrade

    scripts = ScriptDirectory(ALEMBIC_DIR)
    if version == scripts.get_current_head():
        return
    place, file = gradebook_place(root), gradebook_file(root)
    copies = f" If it held grades, replace it with a copy from {file.parent / BACKUPS}." if file is not None else ""
    if version is None:
        raise KitError(
            f"The gradebook {place} does not say which version it has, because its creation was interrupted.",
            f"Move it away, and run again.{copies}",
        )
    if version not in {one.revision for one in scripts.walk_revisions()}:
        raise KitError(
            f"The gradebook {place} has the version {version!r}, which this nbgrader does not know, because"
            " a newer one made it.",
            "Use the environment that it was made with, or a newer version of this kit.",
        )
    copy = back_up(address, "before nbgrader upgrade")
    try:
        upgrade(address)
    except Exception as error:  # it runs a program, which has printed the reason
        kept = f" A copy from before the upgrade is {copy}." if copy else ""
        raise KitError(
            f"The gradebook was made by an older nbgrader, and it could not be upgraded to this version.{kept}",
            "Read the messages above. nbgrader's own command for this is: nbgrader db upgrade",
        ) from error
