"""Read grades from an open gradebook in SQL, because nbgrader takes a second to load and queries each grade alone."""

from __future__ import annotations

import functools
import hashlib
import json
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from autograder.core.grades import CellGrade, Grade
from autograder.core.history import Points
from autograder.gradebook import own_tables

if TYPE_CHECKING:
    from sqlalchemy.engine import Connection, Engine

_OF_SUBMISSION = """
JOIN submitted_notebook sn ON x.notebook_id = sn.id
JOIN submitted_assignment sa ON sn.assignment_id = sa.id
JOIN assignment a ON sa.assignment_id = a.id
JOIN base_cell bc ON x.cell_id = bc.id
"""
_GRADES = f"""
SELECT sa.student_id, a.name AS lab, sn.late_submission_penalty AS penalty, bc.name AS cell, gc.max_score,
       x.auto_score, x.manual_score, x.extra_credit, x.needs_manual_grade,
       EXISTS (SELECT 1 FROM base_cell s WHERE s.name = bc.name AND s.notebook_id = bc.notebook_id
               AND s.type = 'SolutionCell') AS is_answer
FROM grade x {_OF_SUBMISSION} JOIN grade_cells gc ON gc.id = bc.id
WHERE {{wanted}}
ORDER BY sa.student_id, a.name, bc.name
"""
_COMMENTS = f"""
SELECT sa.student_id, a.name AS lab, bc.name AS cell, COALESCE(x.manual_comment, x.auto_comment, '') AS comment
FROM comment x {_OF_SUBMISSION}
WHERE {{wanted}}
"""


def engine_of(address: str, **settings: Any) -> Engine:
    """Return this process's engine for a gradebook, which keeps the queries that it has translated into SQL.

    Call its `dispose` after use.

    Args:
        address: the gradebook's address in the form that SQLAlchemy expects.
        settings: the settings of the engine.
    """
    engine = _engine(address, **settings)
    engine.dispose()  # a use that failed may have left a connection to a file that is gone
    return engine


@functools.cache
def _engine(address: str, **settings: Any) -> Engine:
    from sqlalchemy import create_engine

    return create_engine(address, **settings)


def read_grade(address: str, lab: str, student: str) -> Grade:
    """Return the grade of one submission, which must be in the gradebook.

    Args:
        address: the gradebook's address in the form that SQLAlchemy expects.
        lab: the lab.
        student: the student.
    """
    engine = engine_of(address)
    try:
        with engine.connect() as connection:
            return grades_in(connection, lab, student)[0]
    finally:
        engine.dispose()


def digests(connection: Connection, lab: str, student: str = "") -> dict[str, str]:
    """Return for each student a digest of everything in the gradebook that the feedback page shows."""
    comments: dict[str, list[tuple[str, str]]] = {}
    for (who, _, cell), comment in sorted(_comments(connection, lab, student).items()):
        comments.setdefault(who, []).append((cell, comment))
    entries = own_tables.history(connection, lab, student)
    decided = {who: [one.decided.model_dump() for one in told if one.decided] for who, told in entries.items()}
    found = {}
    for grade in grades_in(connection, lab, student):
        cells = [(cell.grade_id, cell.points, cell.max_points) for cell in grade.cells]
        shown = json.dumps([grade.penalty, cells, comments.get(grade.student), *decided.get(grade.student, [])])
        found[grade.student] = hashlib.sha256(shown.encode()).hexdigest()
    return found


def grades_in(connection: Connection, lab: str, student: str = "") -> list[Grade]:
    """Return the grades in a gradebook, sorted by student and lab. An empty `lab` or `student` means all of them."""
    cells: dict[tuple[str, str, float], list[CellGrade]] = {}
    comments = _comments(connection, lab, student)
    for row in _rows(connection, _GRADES, lab, student):
        comment = comments.get((row.student_id, row.lab, row.cell), "")
        cells.setdefault((row.student_id, row.lab, row.penalty or 0.0), []).append(_cell(row, comment))
    return [Grade(who, name, tuple(found), penalty) for (who, name, penalty), found in cells.items()]


def points_in(connection: Connection, lab: str, student: str) -> tuple[dict[str, Points], float]:
    """Return the points of each cell of a submission, by grade_id, and the penalty for being late."""
    rows = _rows(connection, _GRADES, lab, student)
    points = {
        row.cell: Points(
            auto=row.auto_score,
            by_hand=row.manual_score,
            extra=row.extra_credit,
            most=row.max_score,
            is_check=not row.is_answer,
        )
        for row in rows
    }
    return points, next((row.penalty or 0.0 for row in rows), 0.0)


def _cell(row: Any, comment: str) -> CellGrade:
    given = row.auto_score if row.manual_score is None else row.manual_score
    by_hand = row.manual_score is not None or row.extra_credit is not None
    return CellGrade(
        grade_id=row.cell,
        points=None if given is None else given + (row.extra_credit or 0.0),
        max_points=row.max_score,
        is_check=not row.is_answer,
        by_hand=by_hand,
        comment=comment,
        stale=by_hand and given is not None and bool(row.needs_manual_grade),
    )


def _comments(connection: Connection, lab: str, student: str) -> dict[tuple[str, str, str], str]:
    rows = _rows(connection, _COMMENTS, lab, student)
    return {(row.student_id, row.lab, row.cell): row.comment for row in rows}


def _rows(connection: Connection, query: str, lab: str, student: str) -> Sequence[Any]:
    from sqlalchemy import text

    # Without a condition that an index can answer, the grades of one student take a look at those of the whole class.
    conditions = ["a.name = :lab"] * bool(lab) + ["sa.student_id = :student"] * bool(student)
    wanted = text(query.format(wanted=" AND ".join(conditions) or "1 = 1"))
    return connection.execute(wanted, {"lab": lab, "student": student}).all()
