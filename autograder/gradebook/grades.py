"""The table of grades."""

from __future__ import annotations

import csv
import io
from pathlib import Path

from autograder.core.files import write_beside
from autograder.course.paths import CoursePaths
from autograder.gradebook.scores import read_grades


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
