"""The table of grades."""

from __future__ import annotations

import csv
import io
import math
from pathlib import Path

from autograder.core.files import modified, write_beside
from autograder.course.paths import CoursePaths
from autograder.gradebook.scores import read_grades
from autograder.gradebook.settings import gradebook_file


def write_grades(root: Path) -> Path:
    """Write `build/grades.csv` from the gradebook and return its path.

    A row for each student and lab. The score is what is left after nbgrader's penalty for who was late; it stays empty
    as long as a check waits for an instructor's verdict. `waiting` counts the cells that a person has yet to grade:
    those checks, and explanations, which count 0 until then.
    """
    paths = CoursePaths(root)
    path = paths.grades
    file = gradebook_file(root)
    newest = (
        max(map(modified, (file, *sorted(paths.taken("").parent.glob("*.json"))))) if file is not None else math.inf
    )
    if modified(path) > newest:
        return path
    rows = []
    for grade in read_grades(root):
        score = "" if grade.score is None else f"{grade.score:g}"
        rows.append((grade.student, grade.lab, score, f"{grade.max_score:g}", len(grade.waiting)))
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(("student", "lab", "score", "max_score", "waiting"))
    writer.writerows(rows)
    write_beside(path, text.getvalue())
    return path
