"""Move a student's work and grades to another name, in all labs, because the roster has a new name for the student."""

from __future__ import annotations

import contextlib
import shutil
from pathlib import Path

from sqlalchemy import create_engine, text
from sqlalchemy.engine import Connection

from autograder.course.paths import CoursePaths
from autograder.gradebook import own_tables
from autograder.gradebook.settings import gradebook_address
from autograder.grading.store import ResultStore
from autograder.intake.record import new_names, rename_in_class

_LABS = text(
    "SELECT a.name FROM submitted_assignment s JOIN assignment a ON a.id = s.assignment_id WHERE student_id = :s"
)
_COPY = text(
    "INSERT INTO student (id, first_name, last_name, email, lms_user_id)"
    " SELECT CAST(:new AS VARCHAR(128)), first_name, last_name, email, lms_user_id FROM student WHERE id = :old"
    " AND NOT EXISTS (SELECT 1 FROM student WHERE id = :new)"
)
_MOVE = text(
    "UPDATE submitted_assignment SET student_id = :new WHERE student_id = :old"
    " AND assignment_id = (SELECT id FROM assignment WHERE name = :lab)"
)


def move_renamed(root: Path) -> list[str]:
    """Move everything of students who have a new name, unless it was moved before, and say so.

    What the gradebook already has under the new name for a lab stays, and so does that lab under the old name.

    Raises:
        KitError: the gradebook cannot be used.
    """
    told = []
    engine = create_engine(gradebook_address(root))
    try:
        for old, new in new_names(root).items():
            with engine.begin() as connection:
                labs = _move(connection, root, old, new)
            if labs:
                told.append(f"{old} is called {new} now; the grades and the history of {', '.join(labs)} have moved.")
            with engine.connect() as connection:
                both = sorted(set(connection.execute(_LABS, {"s": old}).scalars()))
            if both:
                told.append(
                    f"{old} and {new} are one person, but both have grades for {', '.join(both)}: look at both."
                )
    finally:
        engine.dispose()
    return told


def _move(connection: Connection, root: Path, old: str, new: str) -> list[str]:
    """Move the labs that only the old name has. The files come last, so an error leaves the gradebook as it was."""
    had, has = (set(connection.execute(_LABS, {"s": name}).scalars()) for name in (old, new))
    labs = sorted(had - has)
    if not labs:
        return []
    connection.execute(_COPY, {"old": old, "new": new})
    own_tables.make_tables(connection)
    for lab in labs:
        connection.execute(_MOVE, {"old": old, "new": new, "lab": lab})
        own_tables.rename_student(connection, lab, old, new)
    for lab in labs:
        _move_files(root, lab, old, new)
        rename_in_class(root, lab, old, new)
        now = own_tables.recorded(connection, lab).get(own_tables.THE_LAB, "")
        own_tables.note_recorded(connection, lab, new, own_tables.recordable(root, lab, now, new))
    return labs


def _move_files(root: Path, lab: str, old: str, new: str) -> None:
    paths, store = CoursePaths(root), ResultStore(root)
    for folder in (paths.submitted, paths.autograded, paths.feedback):
        if folder != paths.feedback and (folder / old / lab).is_dir() and not (folder / new / lab).exists():
            (folder / new).mkdir(parents=True, exist_ok=True)
            (folder / old / lab).rename(folder / new / lab)
        shutil.rmtree(folder / old / lab, ignore_errors=True)
        with contextlib.suppress(OSError):  # other labs are still in it
            (folder / old).rmdir()
    result = store.last(lab, old)
    if result is not None and store.last(lab, new) is None:
        store.save(result.model_copy(update={"student": new}))
    store.remove(lab, old)
