"""Reads grades from nbgrader's gradebook."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from autograder.core.grades import CellGrade, Grade
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
            answers = {cell.name for notebook in assignment.notebooks for cell in notebook.solution_cells}
            for submission in assignment.submissions:
                if submission.student_id not in left:
                    grades.append(_grade(submission, assignment.name, answers))
    return sorted(grades, key=lambda grade: (grade.student, grade.lab))


def _grade(submission: Any, lab: str, answers: set[str]) -> Grade:
    cells = []
    for notebook in submission.notebooks:
        comments = {comment.name: comment.comment or "" for comment in notebook.comments}
        for grade in notebook.grades:
            waits = grade.auto_score is None and grade.manual_score is None
            by_hand = grade.manual_score is not None
            cells.append(
                CellGrade(
                    grade_id=grade.name,
                    points=None if waits else grade.score,
                    max_points=grade.max_score,
                    is_check=grade.name not in answers,
                    by_hand=by_hand,
                    comment=comments.get(grade.name, ""),
                )
            )
    return Grade(submission.student_id, lab, tuple(cells), submission.late_submission_penalty or 0.0)
