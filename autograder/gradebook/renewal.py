"""Make the feedback pages again that no longer show what the gradebook holds, before anybody reads or exports them."""

from __future__ import annotations

from pathlib import Path

from autograder.core.errors import KitError
from autograder.core.files import only_one
from autograder.course.lab import lab_names, load_lab
from autograder.course.paths import CoursePaths
from autograder.gradebook.grades import read_grades, write_grades
from autograder.gradebook.recorder import Recorder


def renew_pages(root: Path, lab: str | None = None) -> None:
    """Renew the pages of a lab, or of all labs, whose grades a person has changed, and `build/grades.csv`.

    A submission that has to be graded again is left as it is; `class_entries` says which ones these are.

    Raises:
        KitError: a page could not be made, or the class is being graded at this moment.
    """
    names = [lab] if lab is not None else lab_names(root)
    due = []
    for name in names:
        recorder = Recorder(root, load_lab(root, name), force=False)
        students = [grade.student for grade in read_grades(root, name)]
        due.append((recorder, [student for student in students if recorder.lacks_only_a_page(student)]))
    if not any(students for _, students in due):
        return
    with only_one(CoursePaths(root).lock, "A grading"):
        for recorder, students in due:
            for student in students:
                recorder.record(student)
            for student, why in recorder.failures.items():
                raise KitError(f"The feedback page of {student} could not be made: {why}.", "Grade the class again.")
        write_grades(root)
