"""Reads the grades of a class from nbgrader's gradebook."""

from __future__ import annotations

from pathlib import Path

from autograder.core.grades import Grade
from autograder.gradebook.one_grade import grade_of
from autograder.gradebook.preparation import prepare_nbgrader
from autograder.gradebook.settings import gradebook_address, gradebook_file
from autograder.intake.record import read_class


def read_grades(root: Path, lab: str | None = None) -> list[Grade]:
    """Return the grade of each student of the class, sorted by student and lab; who has left the class is not in it.

    Args:
        root: of the course.
        lab: whose grades; None: of all labs.
    """
    file = gradebook_file(root)
    if file is not None and not file.is_file():
        return []
    prepare_nbgrader()
    from nbgrader.api import Gradebook

    grades = []
    with Gradebook(gradebook_address(root)) as gradebook:
        for assignment in gradebook.assignments:
            if lab not in (None, assignment.name):
                continue
            left = {student for student, taken in read_class(root, assignment.name).items() if taken.left}
            grades += [grade_of(one) for one in assignment.submissions if one.student_id not in left]
    return sorted(grades, key=lambda grade: (grade.student, grade.lab))
