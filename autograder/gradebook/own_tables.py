"""The kit's own tables in the gradebook. They are copied, moved and restored together with nbgrader's tables.

`recorded` holds a digest of what was recorded last for a submission. If the submission now has another digest, it is
recorded again. `judged` holds a digest of the work that a person saw when grading a cell. If the work has changed since
then, the grade is kept, and a person is asked to look at it again. `history` holds the entries of `core.history`; they
are never changed or removed, but they follow a student to a new name.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sqlalchemy import Column, Integer, MetaData, String, Table, Text, delete, insert, inspect, select, text, update
from sqlalchemy.engine import Connection

from autograder.core.history import Entry
from autograder.course.paths import CoursePaths
from autograder.grading.store import ResultStore
from autograder.submission import timestamp

if TYPE_CHECKING:
    from sqlalchemy.orm import Session, scoped_session

    Talks = Connection | Session | scoped_session[Session]

THE_LAB = ""
"""The value that takes the place of a student's name in the row for the lab itself."""

_TABLES = MetaData()
_RECORDED = Table(
    "autograder_recorded",
    _TABLES,
    Column("lab", String(128), primary_key=True),
    Column("student", String(128), primary_key=True),
    Column("digest", String(64), nullable=False),
)
_JUDGED = Table(
    "autograder_judged",
    _TABLES,
    Column("grade", String(32), primary_key=True),
    Column("digest", String(64), nullable=False),
)
_HISTORY = Table(
    "autograder_history",
    _TABLES,
    Column("number", Integer, primary_key=True, autoincrement=True),
    Column("lab", String(128), nullable=False, index=True),
    Column("student", String(128), nullable=False),
    Column("entry", Text, nullable=False),
)
_INDEXES = {
    "grade": "notebook_id",
    "comment": "notebook_id",
    "submitted_notebook": "assignment_id",
    "submitted_assignment": "student_id",
    _HISTORY.name: "lab, student",
}
"""The columns by which one student's rows are looked for, by table. nbgrader has no indexes for its own tables."""


def make_tables(engine: Any) -> None:
    """Create the tables that a gradebook does not have yet."""
    _TABLES.create_all(engine)


def make_indexes(connection: Connection) -> None:
    """Create the indexes that a gradebook does not have yet, so that a student costs the same in a large class.

    Without them, each question about one student reads the rows of the whole class: in a class of 10,000, recording a
    student takes more than three times as long as in a class of 10.
    """
    make_tables(connection)
    for table, columns in _INDEXES.items():
        connection.execute(text(f"CREATE INDEX IF NOT EXISTS autograder_of_{table} ON {table} ({columns})"))


def digest_of(*parts: object) -> str:
    """Return a digest of some values, which must be values that JSON can represent."""
    return hashlib.sha256(json.dumps(parts).encode()).hexdigest()


def recordable(root: Path, lab: str, source_digest: str, student: str) -> str:
    """Return a digest of everything that is recorded for a submission.

    Args:
        root: the course's folder.
        lab: the lab.
        source_digest: the digest of the lab's notebook.
        student: the student who handed it in.
    """
    handed_in = CoursePaths(root).submitted_notebook(student, lab).with_name(timestamp.FILE_NAME)
    contents = (ResultStore(root).path(lab, student), handed_in)
    return digest_of(source_digest, *(hashlib.sha256(_content(path)).hexdigest() for path in contents))


def _content(path: Path) -> bytes:
    try:
        return path.read_bytes()
    except OSError:
        return b""


def recorded(connection: Connection, lab: str, student: str | None = None) -> dict[str, str]:
    """Return the digests of what was recorded for a lab, or for one of its submissions, by student."""
    if not inspect(connection).has_table(_RECORDED.name):
        return {}
    of_student = [] if student is None else [_RECORDED.c.student == student]
    rows = connection.execute(
        select(_RECORDED.c.student, _RECORDED.c.digest).where(_RECORDED.c.lab == lab, *of_student)
    )
    return {row.student: row.digest for row in rows}


def history(talks: Talks, lab: str, student: str = "") -> dict[str, list[Entry]]:
    """Return the entries of a lab, or of one of its submissions, by student, the oldest first."""
    connection = talks if isinstance(talks, Connection) else talks.connection()
    found: dict[str, list[Entry]] = {}
    if inspect(connection).has_table(_HISTORY.name):
        of_student = [_HISTORY.c.student == student] if student else []
        wanted = select(_HISTORY).where(_HISTORY.c.lab == lab, *of_student).order_by(_HISTORY.c.number)
        for row in connection.execute(wanted):
            found.setdefault(row.student, []).append(Entry.model_validate_json(row.entry))
    return found


def rename_student(talks: Talks, lab: str, old: str, new: str) -> None:
    """Give everything that these tables have about a submission to the student's new name."""
    talks.execute(delete(_RECORDED).where(_RECORDED.c.lab == lab, _RECORDED.c.student.in_([old, new])))
    of_old = update(_HISTORY).where(_HISTORY.c.lab == lab, _HISTORY.c.student == old)
    talks.execute(of_old.values(student=new))


def note_history(talks: Talks, lab: str, student: str, entry: Entry) -> None:
    """Add an entry to the history of a submission."""
    talks.execute(insert(_HISTORY).values(lab=lab, student=student, entry=entry.model_dump_json()))


def note_recorded(talks: Talks, lab: str, student: str, digest: str) -> None:
    """Store the digest of what was recorded for a submission."""
    _put(talks, _RECORDED, [("lab", lab), ("student", student)], digest)


def judged(talks: Talks, grade: str) -> str | None:
    """Return the digest of the work that a cell's grade was last recorded for; None if there is none."""
    digest: str | None = talks.execute(select(_JUDGED.c.digest).where(_JUDGED.c.grade == grade)).scalar()
    return digest


def note_judged(talks: Talks, grade: str, digest: str) -> None:
    """Store the digest of the work that a cell's grade is for."""
    _put(talks, _JUDGED, [("grade", grade)], digest)


def _put(talks: Talks, table: Table, keys: Sequence[tuple[str, str]], digest: str) -> None:
    talks.execute(delete(table).where(*(table.c[name] == value for name, value in keys)))
    talks.execute(insert(table).values(**dict(keys), digest=digest))
