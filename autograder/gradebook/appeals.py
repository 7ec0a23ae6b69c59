"""Appeals that instructors have received: whose they are, which of them wait, and the answers to them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from autograder.core.errors import KitError
from autograder.core.files import only_one, write_beside
from autograder.core.grades import in_points
from autograder.core.history import Decided, Decision
from autograder.course.lab import Lab, load_lab
from autograder.course.paths import CoursePaths
from autograder.gradebook import own_tables
from autograder.gradebook.api import open_api
from autograder.gradebook.grades import read_history, write_grades
from autograder.gradebook.history import note_decided
from autograder.gradebook.recorder import Recorder
from autograder.grading.appeal import ENDING, Appeal, handed_in, read_appeal
from autograder.grading.store import ResultStore
from autograder.report.term_page import Appeal as Waiting
from autograder.submission.reader import read_submission


def owner(root: Path, appeal: Appeal, lab: Lab) -> str:
    """Return the student whose answers the appeal holds; empty if nobody handed in these answers.

    The name in the file is only a claim. It decides between students who handed in the same answers.
    """
    theirs, paths = handed_in(appeal, lab), CoursePaths(root)
    found = []
    for result in ResultStore(root).all(lab.name):
        known = read_submission(paths.submitted_notebook(result.student, lab.name), lab)
        if known.readable and (known.sources, known.files) == (theirs.sources, theirs.files):
            found.append(result.student)
    return appeal.student if appeal.student in found else found[0] if len(found) == 1 else ""


def keep(root: Path, path: Path, appeal: Appeal) -> Path:
    """Copy an appeal to the course's appeals, and return the path of the copy."""
    folder = CoursePaths(root).appeals
    if path.resolve().parent == folder.resolve():
        return path
    digest = own_tables.digest_of(appeal.model_dump_json())[:12]
    kept = folder / f"{appeal.lab}_{digest}{ENDING}"
    if not kept.is_file():
        write_beside(kept, path.read_bytes())
    return kept


def waiting(root: Path) -> tuple[list[Waiting], list[str]]:
    """Return the appeals that nobody has answered yet, and sentences about files that are no appeals."""
    found, damaged = [], []
    for path in sorted(CoursePaths(root).appeals.glob(f"*{ENDING}")):
        try:
            appeal = read_appeal(path)
            lab = load_lab(root, appeal.lab)
        except KitError as error:
            damaged.append(error.what)
            continue
        who = owner(root, appeal, lab)
        entries = read_history(root, lab.name, who).get(who, []) if who else []
        answered = {(entry.decided.cell, entry.decided.asked) for entry in entries if entry.decided is not None}
        if (appeal.check, appeal.sentence) not in answered:
            name = who or f"nobody's answers; the file says {appeal.student!r}"
            when = f"{appeal.made:%Y-%m-%d}"
            found.append(Waiting(name, lab.name, appeal.check, when, appeal.sentence, str(path.relative_to(root))))
    return found, damaged


def decide(
    root: Path, student: str, appeal: Appeal, decision: Decision, reason: str, points: float | None
) -> list[str]:
    """Record the answer to an appeal, in one go with the points if it is granted, and renew the student's page.

    Args:
        root: the course's folder.
        student: the student, by the name in the gradebook.
        appeal: the appeal.
        decision: the answer.
        reason: the reason, which the student reads.
        points: the points that the check gets if the appeal is granted; None for all of its points.

    Returns:
        Sentences about what was done.

    Raises:
        KitError: the gradebook does not have this check of this student, or the points are impossible.
    """
    lab = load_lab(root, appeal.lab)
    told = []
    answer = Decided(cell=appeal.check, asked=appeal.sentence, decision=decision, reason=reason)
    with only_one(CoursePaths(root).lock, "A grading"):
        with open_api(root).gradebook as gradebook:
            grade = _grade(gradebook, student, appeal)
            given = (grade.max_score if points is None else points) if decision is Decision.GRANTED else None
            if given is not None and not 0 <= given <= grade.max_score:
                raise KitError(
                    f"{appeal.check} gives 0 to {grade.max_score:g} points, not {given:g}.", "Name other points."
                )
            own_tables.make_tables(gradebook.db.connection())
            note_decided(gradebook.db, lab.name, student, answer, given)
            if given is not None:
                grade.manual_score, grade.needs_manual_grade = given, False
                told.append(f"{student} has {in_points(given)} for {appeal.check} now.")
            gradebook.db.commit()
        recorder = Recorder(root, lab, force=False)
        if recorder.lacks_only_a_page(student):
            recorder.record(student)
            told.append(f"The feedback page was renewed: {CoursePaths(root).feedback_page(student, lab.name)}")
        else:
            told.append(
                f"The feedback page shows the answer when you grade again: autograder grade {lab.name} SUBMISSIONS"
            )
        write_grades(root)
    return told


def _grade(gradebook: Any, student: str, appeal: Appeal) -> Any:
    from nbgrader.api import MissingEntry

    try:
        return gradebook.find_grade(appeal.check, appeal.lab, appeal.lab, student)
    except MissingEntry as error:
        raise KitError(f"The gradebook has no check {appeal.check} of {student}.", "Grade the class first.") from error
