"""The answers in words of a class: read them for one page, and give several of them the same points and comment."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from autograder.core.errors import KitError
from autograder.core.files import only_one
from autograder.course.lab import Answer, Lab
from autograder.course.paths import CoursePaths
from autograder.gradebook.api import open_api
from autograder.gradebook.grades import read_grades
from autograder.report.answers_page import WrittenAnswer
from autograder.submission.reader import read_submission


def question(lab: Lab, cell: str) -> Answer:
    """Return an answer cell that a person grades.

    Raises:
        KitError: the lab has no such cell.
    """
    found = {name: answer for name, answer in lab.answers.items() if answer.points is not None}
    if cell not in found:
        raise KitError(f"{lab.name} has no answer `{cell}` that a person grades.", f"It has: {', '.join(found)}.")
    return found[cell]


def written_answers(root: Path, lab: Lab, cell: str) -> list[WrittenAnswer]:
    """Return the answers of the class to a question, sorted by student.

    Raises:
        KitError: the lab has no such question, or nobody has a grade.
    """
    question(lab, cell)
    found = []
    for grade in read_grades(root, lab.name):
        submission = read_submission(CoursePaths(root).submitted_notebook(grade.student, lab.name), lab)
        of_cell = next((one for one in grade.cells if one.grade_id == cell), None)
        if submission.readable and of_cell is not None:
            found.append(WrittenAnswer(grade.student, submission.sources[cell], of_cell))
    if not found:
        raise KitError(
            f"There are no answers to {cell} yet.", f"Grade a class first: autograder grade {lab.name} SUBMISSIONS"
        )
    return found


def mark(
    root: Path, lab: Lab, cell: str, points: float, students: Sequence[str], comment: str
) -> dict[str, float | None]:
    """Give the answers of several students to a question the same points and comment, all of them or none.

    Returns the points that each student had before, so that nobody overwrites another person's points unnoticed; None
    if nobody had graded the answer.

    Args:
        root: the course's folder.
        lab: the lab.
        cell: the grade_id of the question.
        points: the points for each answer.
        students: the students.
        comment: what the students read about the answer; empty to leave their comments as they are.

    Raises:
        KitError: the lab has no such question, the points are impossible, or a student has no such answer.
    """
    most = question(lab, cell).points or 0.0
    if not 0 <= points <= most:
        raise KitError(f"{cell} gives 0 to {most:g} points, not {points:g}.", "Name other points.")
    given = {answer.student: answer.grade.points for answer in written_answers(root, lab, cell)}
    strangers = sorted(set(students) - set(given))
    if strangers:
        raise KitError(f"{', '.join(strangers)} handed in no answer to {cell}. Nobody got points.", "Check the names.")
    with only_one(CoursePaths(root).lock, "A grading"), open_api(root).gradebook as gradebook:
        for student in students:
            grade = gradebook.find_grade(cell, lab.name, lab.name, student)
            grade.manual_score, grade.needs_manual_grade = points, False
            if comment:
                gradebook.find_comment(cell, lab.name, lab.name, student).manual_comment = comment
        gradebook.db.commit()
    return {student: given[student] for student in students}
