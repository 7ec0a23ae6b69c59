"""The grades of a class, as the gradebook has them: to be asked for, as a table, and with all that goes out."""

from __future__ import annotations

import csv
import hashlib
import io
import json
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from autograder.core.files import write_beside
from autograder.core.grades import CellGrade, Grade
from autograder.course.paths import CoursePaths
from autograder.gradebook.database import damage_told
from autograder.gradebook.settings import gradebook_address, gradebook_file
from autograder.grading.store import ResultStore
from autograder.intake.record import Taken, left_class, read_class
from autograder.intake.roster import FILE_NAME, read_roster
from autograder.report.export.entry import Entry

if TYPE_CHECKING:
    from sqlalchemy.engine import Connection

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
WHERE :lab IN ('', a.name) AND :student IN ('', sa.student_id)
ORDER BY sa.student_id, a.name, bc.name
"""
_COMMENTS = f"""
SELECT sa.student_id, a.name AS lab, bc.name AS cell, COALESCE(x.manual_comment, x.auto_comment, '') AS comment
FROM comment x {_OF_SUBMISSION}
WHERE :lab IN ('', a.name) AND :student IN ('', sa.student_id)
"""


def read_grade(address: str, lab: str, student: str) -> Grade:
    """Return the grade of one submission, which the gradebook has.

    Args:
        address: of the gradebook.
        lab: that was handed in.
        student: who handed it in.
    """
    from sqlalchemy import create_engine

    engine = create_engine(address)
    try:
        with engine.connect() as connection:
            return grades_in(connection, lab, student)[0]
    finally:
        engine.dispose()


def digests(connection: Connection, lab: str, student: str = "") -> dict[str, str]:
    """Return by student what tells all that feedback shows of the gradebook from what it showed before."""
    comments: dict[str, list[tuple[str, str]]] = {}
    for (who, _, cell), comment in sorted(_comments(connection, lab, student).items()):
        comments.setdefault(who, []).append((cell, comment))
    found = {}
    for grade in grades_in(connection, lab, student):
        cells = [(cell.grade_id, cell.points, cell.max_points) for cell in grade.cells]
        shown = json.dumps([grade.penalty, cells, comments.get(grade.student)])
        found[grade.student] = hashlib.sha256(shown.encode()).hexdigest()
    return found


def grades_in(connection: Connection, lab: str, student: str = "") -> list[Grade]:
    """Return the grades in a gradebook, sorted by student and lab; empty for `lab` or `student`: of all."""
    cells: dict[tuple[str, str, float], list[CellGrade]] = {}
    comments = _comments(connection, lab, student)
    for row in _rows(connection, _GRADES, lab, student):
        comment = comments.get((row.student_id, row.lab, row.cell), "")
        cells.setdefault((row.student_id, row.lab, row.penalty or 0.0), []).append(_cell(row, comment))
    return [Grade(who, name, tuple(found), penalty) for (who, name, penalty), found in cells.items()]


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

    return connection.execute(text(query), {"lab": lab, "student": student}).all()


Answer = TypeVar("Answer")


def ask(root: Path, question: Callable[[Connection], Answer], nothing: Answer) -> Answer:
    """Return what a question finds in the gradebook; `nothing` where nbgrader has written none yet."""
    file = gradebook_file(root)
    if file is not None and not file.is_file():
        return nothing
    from sqlalchemy import create_engine, inspect

    engine = create_engine(gradebook_address(root))
    try:
        with damage_told(root), engine.connect() as connection:
            return question(connection) if inspect(connection).has_table("grade") else nothing
    finally:
        engine.dispose()


def read_grades(root: Path, lab: str = "") -> list[Grade]:
    """Return the grade of each student of the class, sorted by student and lab; who has left the class is not in it.

    Args:
        root: of the course.
        lab: whose grades; empty: of all labs.
    """
    nobody: list[Grade] = []
    grades = ask(root, lambda connection: grades_in(connection, lab), nobody)
    left = {name: left_class(root, name) for name in {grade.lab for grade in grades}}
    return [grade for grade in grades if grade.student not in left[grade.lab]]


def write_grades(root: Path) -> Path:
    """Write `build/grades.csv` from the gradebook and return its path.

    A row for each student and lab. The score is what is left after nbgrader's penalty for who was late; it stays empty
    as long as a check waits for an instructor's verdict. `waiting` counts the cells that a person has yet to grade:
    those checks, and explanations, which count 0 until then; and those to be looked at again, since what was graded by
    hand has changed.
    """
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(("student", "lab", "score", "max_score", "waiting"))
    for grade in read_grades(root):
        score = "" if grade.score is None else f"{grade.score:g}"
        waiting = len(grade.waiting) + len(grade.stale)
        writer.writerow((grade.student, grade.lab, score, f"{grade.max_score:g}", waiting))
    path = CoursePaths(root).grades
    write_beside(path, text.getvalue())
    return path


def class_entries(root: Path, lab: str | None = None) -> list[Entry]:
    """Return the submissions of a class, sorted by lab and student.

    Args:
        root: of the course.
        lab: whose; None: of all labs.

    Raises:
        KitError: the roster cannot be used.
    """
    paths = CoursePaths(root)
    roster = read_roster(root / FILE_NAME).students if (root / FILE_NAME).is_file() else {}
    grades = {(grade.lab, grade.student): grade for grade in read_grades(root, lab or "")}
    results = ResultStore(root).all(lab)
    classes = {name: read_class(root, name) for name in {result.lab for result in results}}
    entries = []
    for result in results:
        taken = classes[result.lab].get(result.student, Taken(source=""))
        page = paths.feedback_page(result.student, result.lab)
        entries.append(
            Entry(
                student=result.student,
                lab=result.lab,
                result=result,
                grade=grades.get((result.lab, result.student)),
                known=taken.owner | {key: value for key, value in roster.get(result.student, {}).items() if value},
                file=taken.file,
                late=taken.late,
                feedback=page if page.is_file() else None,
            )
        )
    return entries
