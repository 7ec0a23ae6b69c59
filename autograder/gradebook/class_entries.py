"""A class, put together for what goes out: results, grades, and what the learning platforms call everybody."""

from __future__ import annotations

from pathlib import Path

from autograder.course.paths import CoursePaths
from autograder.gradebook.scores import read_grades
from autograder.grading.store import ResultStore
from autograder.intake.record import Taken, read_class
from autograder.intake.roster import FILE_NAME, read_roster
from autograder.report.export.entry import Entry


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
