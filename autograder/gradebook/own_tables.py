"""What the kit notes in the gradebook beside nbgrader's own tables: there it is copied, moved and put back with them.

`recorded` is what of a submission was recorded last; where that differs from what there is now, it is recorded again.
`judged` is what of a submission stood in front of a person who graded a cell; where that differs from what stands there
now, the grade stays, and a person is asked to look at it again.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sqlalchemy import Column, MetaData, String, Table, delete, insert, select

from autograder.course.lab import Lab
from autograder.course.paths import CoursePaths
from autograder.grading.store import ResultStore
from autograder.submission import timestamp

if TYPE_CHECKING:
    from sqlalchemy.engine import Connection
    from sqlalchemy.orm import Session, scoped_session

    Talks = Connection | Session | scoped_session[Session]

THE_LAB = ""
"""In place of a student: what the gradebook knows of the lab itself."""

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


def make_tables(engine: Any) -> None:
    """Make the tables in a gradebook that has none of them yet."""
    _TABLES.create_all(engine)


def digest_of(*parts: object) -> str:
    """Return what tells these values from others; they are what JSON can hold."""
    return hashlib.sha256(json.dumps(parts).encode()).hexdigest()


def recordable(root: Path, lab: Lab, student: str) -> str:
    """Return what tells all that is recorded of a submission from what was recorded before."""
    handed_in = CoursePaths(root).submitted_notebook(student, lab.name).with_name(timestamp.FILE_NAME)
    contents = (ResultStore(root).path(lab.name, student), handed_in)
    return digest_of(lab.source_digest, *(hashlib.sha256(_content(path)).hexdigest() for path in contents))


def _content(path: Path) -> bytes:
    try:
        return path.read_bytes()
    except OSError:
        return b""


def recorded(connection: Connection, lab: str) -> dict[str, str]:
    """Return the digests of what was recorded of a lab, by student."""
    from sqlalchemy import inspect

    if not inspect(connection).has_table(_RECORDED.name):
        return {}
    rows = connection.execute(select(_RECORDED.c.student, _RECORDED.c.digest).where(_RECORDED.c.lab == lab))
    return {row.student: row.digest for row in rows}


def note_recorded(talks: Talks, lab: str, student: str, digest: str) -> None:
    """Note what was recorded."""
    _put(talks, _RECORDED, [("lab", lab), ("student", student)], digest)


def judged(talks: Talks, grade: str) -> str | None:
    """Return what a cell's grade was about when it was recorded last; None if nobody noted it."""
    digest: str | None = talks.execute(select(_JUDGED.c.digest).where(_JUDGED.c.grade == grade)).scalar()
    return digest


def note_judged(talks: Talks, grade: str, digest: str) -> None:
    """Note what a cell's grade is about."""
    _put(talks, _JUDGED, [("grade", grade)], digest)


def _put(talks: Talks, table: Table, keys: Sequence[tuple[str, str]], digest: str) -> None:
    talks.execute(delete(table).where(*(table.c[name] == value for name, value in keys)))
    talks.execute(insert(table).values(**dict(keys), digest=digest))
