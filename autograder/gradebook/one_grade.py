"""Reads the grade of one submission from an open gradebook, or from its address."""

from __future__ import annotations

from typing import Any

from autograder.core.grades import CellGrade, Grade


def read_grade(address: str, lab: str, student: str) -> Grade:
    """Return the grade of one submission.

    Args:
        address: of the gradebook.
        lab: that was handed in.
        student: who handed it in.
    """
    from nbgrader.api import Gradebook

    with Gradebook(address) as gradebook:
        return grade_of(gradebook.find_submission(lab, student))


def grade_of(submission: Any) -> Grade:
    """Return the grade of one of nbgrader's submissions."""
    assignment = submission.assignment
    answers = {cell.name for notebook in assignment.notebooks for cell in notebook.solution_cells}
    cells = []
    for notebook in submission.notebooks:
        comments = {comment.name: comment.comment or "" for comment in notebook.comments}
        for grade in notebook.grades:
            waits = grade.auto_score is None and grade.manual_score is None
            cells.append(
                CellGrade(
                    grade_id=grade.name,
                    points=None if waits else grade.score,
                    max_points=grade.max_score,
                    is_check=grade.name not in answers,
                    by_hand=grade.manual_score is not None,
                    comment=comments.get(grade.name, ""),
                )
            )
    return Grade(submission.student_id, assignment.name, tuple(cells), submission.late_submission_penalty or 0.0)
