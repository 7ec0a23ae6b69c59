"""The table of grades."""

from __future__ import annotations

import csv
import io
from pathlib import Path

from autograder.core.files import modified, write_beside
from autograder.course.paths import CoursePaths
from autograder.gradebook.preparation import prepare_nbgrader
from autograder.gradebook.settings import gradebook_address, gradebook_file


def write_grades(root: Path) -> Path:
    """Write `build/grades.csv` from the gradebook and return its path.

    A row for each student and lab. The score is what is left after nbgrader's penalty for who was late; it stays empty
    as long as a check waits for an instructor's verdict. `waiting` counts the cells that a person has yet to grade:
    those checks, and explanations, which count 0 until then.
    """
    paths = CoursePaths(root)
    path = paths.grades
    file = gradebook_file(root)
    if file is not None and modified(path) > modified(file):
        return path
    prepare_nbgrader()
    from nbgrader.api import Gradebook

    rows: list[tuple[str, str, str, str, int]] = []
    with Gradebook(gradebook_address(root)) as gradebook:
        for assignment in gradebook.assignments:
            answers = {cell.name for notebook in assignment.notebooks for cell in notebook.solution_cells}
            for submission in assignment.submissions:
                grades = [grade for notebook in submission.notebooks for grade in notebook.grades]
                waiting = [grade.name for grade in grades if grade.auto_score is None and grade.manual_score is None]
                left = max(0.0, sum(grade.score for grade in grades) - submission.late_submission_penalty)
                score = "" if set(waiting) - answers else f"{left:g}"
                top = f"{sum(grade.max_score for grade in grades):g}"
                rows.append((submission.student_id, assignment.name, score, top, len(waiting)))
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(("student", "lab", "score", "max_score", "waiting"))
    writer.writerows(sorted(rows))
    write_beside(path, text.getvalue())
    return path
