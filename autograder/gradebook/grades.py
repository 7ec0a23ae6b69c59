"""Read the grades of a class from the gradebook, write them as a table, and combine them with data for exports."""

from __future__ import annotations

import csv
import io
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

from autograder.core.files import write_beside
from autograder.core.grades import Grade
from autograder.core.history import Entry as HistoryEntry
from autograder.course.paths import CoursePaths
from autograder.gradebook.database import damage_told
from autograder.gradebook.own_tables import THE_LAB, history, recordable, recorded
from autograder.gradebook.pages import shows
from autograder.gradebook.queries import digests, engine_of, grades_in
from autograder.gradebook.settings import gradebook_address, gradebook_file
from autograder.grading.store import ResultStore
from autograder.intake.record import Taken, left_class, read_class
from autograder.intake.roster import FILE_NAME, read_roster
from autograder.report.export.entry import Entry

if TYPE_CHECKING:
    from sqlalchemy.engine import Connection

Answer = TypeVar("Answer")


def ask(root: Path, question: Callable[[Connection], Answer], nothing: Answer) -> Answer:
    """Return the answer to a question about the gradebook; `nothing` if nbgrader has not written a gradebook yet."""
    file = gradebook_file(root)
    if file is not None and not file.is_file():
        return nothing
    from sqlalchemy import inspect

    engine = engine_of(gradebook_address(root))
    try:
        with damage_told(root), engine.connect() as connection:
            return question(connection) if inspect(connection).has_table("grade") else nothing
    finally:
        engine.dispose()


def read_grades(root: Path, lab: str = "") -> list[Grade]:
    """Return the grades of all students, sorted by student and lab, without students who have left the class.

    Args:
        root: the course's folder.
        lab: the lab; empty for all labs.
    """
    nobody: list[Grade] = []
    grades = ask(root, lambda connection: grades_in(connection, lab), nobody)
    left = {name: left_class(root, name) for name in {grade.lab for grade in grades}}
    return [grade for grade in grades if grade.student not in left[grade.lab]]


def read_history(root: Path, lab: str, student: str = "") -> dict[str, list[HistoryEntry]]:
    """Return what happened to the points in a lab, by student, the oldest entry first.

    Args:
        root: the course's folder.
        lab: the lab.
        student: the student; empty for all students.
    """
    nothing: dict[str, list[HistoryEntry]] = {}
    return ask(root, lambda connection: history(connection, lab, student), nothing)


def write_grades(root: Path) -> Path:
    """Write `build/grades.csv` from the gradebook and return its path.

    The table has a row for each student and lab. `score` is the score after nbgrader's penalty for late submissions. It
    is empty as long as a check waits for an instructor's verdict. `waiting` is the number of cells that a person has
    yet to grade or should look at again: checks without a verdict, explanations, which count 0 until they are graded,
    and cells whose work has changed since they were graded by hand.
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


def roster_lines(root: Path) -> Mapping[str, Mapping[str, str]]:
    """Return the lines of the course's roster, by student; empty if there is no roster.

    Raises:
        KitError: the roster cannot be read.
    """
    return read_roster(root / FILE_NAME).students if (root / FILE_NAME).is_file() else {}


def class_entries(root: Path, lab: str | None = None) -> list[Entry]:
    """Return the submissions of a class, sorted by lab and student.

    Args:
        root: the course's folder.
        lab: the lab; None for all labs.

    Raises:
        KitError: the roster, the record of the class or the gradebook cannot be read.
    """
    paths = CoursePaths(root)
    roster = roster_lines(root)
    grades = {(grade.lab, grade.student): grade for grade in read_grades(root, lab or "")}
    results = ResultStore(root).all(lab)
    classes = {name: read_class(root, name) for name in {result.lab for result in results}}
    histories = {name: read_history(root, name) for name in classes}
    stale = stale_submissions(root, [(result.lab, result.student) for result in results])
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
                history=histories[result.lab].get(result.student, ()),
                stale=(result.lab, result.student) in stale,
            )
        )
    return entries


def stale_submissions(root: Path, submissions: Sequence[tuple[str, str]]) -> set[tuple[str, str]]:
    """Return the submissions, by lab and student, whose result, grade and page do not belong together.

    A lab that was changed after the class was graded does not count: its grades and pages are still those of the class.
    """
    paths, stale = CoursePaths(root), set()
    for lab in {name for name, _ in submissions}:
        known: tuple[dict[str, str], dict[str, str]] = ({}, {})
        known = ask(root, lambda talks, lab=lab: (recorded(talks, lab), digests(talks, lab)), known)  # type: ignore[misc]
        was_recorded, shown = known
        for student in [student for name, student in submissions if name == lab and student in shown]:
            now = recordable(root, lab, was_recorded.get(THE_LAB, ""), student)
            if was_recorded.get(student) != now or not shows(paths.feedback_page(student, lab), shown[student]):
                stale.add((lab, student))
    return stale
