"""Has a place for the gradebook, and brings one of an older nbgrader's to the form of this one."""

from __future__ import annotations

from pathlib import Path

from autograder.core.errors import KitError
from autograder.course.paths import CoursePaths
from autograder.gradebook.backup import back_up
from autograder.gradebook.preparation import prepare_nbgrader
from autograder.gradebook.settings import gradebook_address, gradebook_file


def make_room(root: Path) -> None:
    """Make the folder of a course's gradebook; one from where earlier versions kept it moves there.

    Raises:
        OSError: nothing may be written there.
    """
    file = CoursePaths(root).gradebook
    file.parent.mkdir(exist_ok=True)
    earlier = CoursePaths(root).build / file.name
    if earlier.is_file() and not file.exists():
        earlier.replace(file)


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
        KitError: it cannot be changed; the copy is there.
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

    if version == ScriptDirectory(ALEMBIC_DIR).get_current_head():
        return
    copy = back_up(address, "before nbgrader upgrade")
    try:
        upgrade(address)
    except Exception as error:  # it runs a program, which has said what is wrong
        kept = f" A copy of it as it was is {copy}." if copy else ""
        raise KitError(
            f"The gradebook, which an older nbgrader made, cannot be brought to the form of this one.{kept}",
            "Read what is said above; nbgrader's own command for it is: nbgrader db upgrade",
        ) from error
