"""The gradebook's database: it can be written, and has the form of this nbgrader, whether it is new or an older one."""

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
from autograder.gradebook.settings import gradebook_address, gradebook_file, gradebook_place


def make_folder(root: Path) -> None:
    """Make the folder of a course's gradebook; one from where earlier versions kept it moves there.

    Raises:
        OSError: nothing may be written there.
    """
    file = CoursePaths(root).gradebook
    file.parent.mkdir(exist_ok=True)
    earlier = CoursePaths(root).build / file.name
    if earlier.is_file() and not file.exists():
        earlier.replace(file)


def make_usable(root: Path) -> None:
    """Have a gradebook of a course that can be written and has the form of this nbgrader's.

    Raises:
        KitError: it is damaged, or cannot be brought to that form.
        OSError, sqlite3.OperationalError: it cannot be written.
    """
    make_folder(root)
    with damage_told(root):
        _refuse_unwritable(root)
        _create(root)
        bring_up_to_date(root)
        name_course(root)


@contextlib.contextmanager
def damage_told(root: Path) -> Iterator[None]:
    """Say of a gradebook that is no database any more what is to be done.

    Raises:
        KitError: it is none.
    """
    try:
        yield
    except Exception as error:  # SQLAlchemy's error is around that of the database
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
    """Make a gradebook that is not there yet, whole or not at all: the disk may fill meanwhile."""
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
        with Gradebook(f"sqlite:///{beside}", course_id=""):
            pass
        beside.replace(file)
    finally:
        for end in ("", "-journal"):
            Path(f"{beside}{end}").unlink(missing_ok=True)


def name_course(root: Path) -> None:
    """Note a course without a name in a gradebook on a server, which takes no lab of a course that is not noted.

    nbgrader notes only those with a name, and gets by with that in a file, where nobody looks after such things.
    """
    if gradebook_file(root) is not None:
        return
    prepare_nbgrader()
    from nbgrader.api import Course, Gradebook

    with Gradebook(gradebook_address(root)) as gradebook:
        if gradebook.db.get(Course, "") is None:
            gradebook.db.add(Course(id=""))
            gradebook.db.commit()


def bring_up_to_date(root: Path) -> None:
    """Give a gradebook that an older nbgrader made the form of this one, after a copy of it was made.

    Raises:
        KitError: it cannot be changed, and the copy is there; or nothing says who made it, or a newer nbgrader did.
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
            f"The gradebook {place} does not say which version it has: it was left unfinished when it was made.",
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
    except Exception as error:  # it runs a program, which has said what is wrong
        kept = f" A copy of it as it was is {copy}." if copy else ""
        raise KitError(
            f"The gradebook was made by an older nbgrader, and it could not be upgraded to this version.{kept}",
            "Read what is said above; nbgrader's own command for it is: nbgrader db upgrade",
        ) from error
