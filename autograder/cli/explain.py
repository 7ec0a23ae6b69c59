"""The command `autograder explain`, which shows everything that is known about a submission or one of its checks."""

from __future__ import annotations

import re
import shlex
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from autograder.cli.app import CourseOption, app
from autograder.core.errors import KitError

if TYPE_CHECKING:
    from autograder.core.results import CheckResult, SubmissionResult


@app.command()
def explain(
    student: Annotated[str, typer.Argument(help="The student, by the name in the gradebook.")],
    check: Annotated[str, typer.Argument(help="The check: its number, its id, or a part of its title.")] = "",
    lab: Annotated[str, typer.Option(help="The lab, if the student handed in several.")] = "",
    course: CourseOption = None,
) -> None:
    """Show everything that grading found: outcomes, evidence, output, flags, pictures, and messages as an MCAP file.

    To get the messages, the check is run again with the same random values.
    """
    from autograder.cli.chosen import chosen as named
    from autograder.course.paths import CoursePaths, course_root
    from autograder.course.settings import read_book
    from autograder.report.terminal import console, evidence_view, submission_view

    root = course_root(course)
    result, book = _result(root, student, lab), read_book(root)
    folder = CoursePaths(root).explained / result.lab / student
    screen = console()
    if not check:
        screen.print(submission_view(result, "instructor", book))
        for path in pictures(result.checks, folder):
            print(path)
        _in_gradebook(root, result)
        _history(root, result)
        screen.print("To see all evidence and messages of a check, name the check, such as: ", end="")
        screen.print(f"autograder explain {shlex.quote(student)} 1 --lab {result.lab}", markup=False)
        return
    chosen = named(result.checks, check, result.lab)
    screen.print(evidence_view(chosen, book))
    for path in pictures([chosen], folder):
        print(path)
    _history(root, result, chosen.grade_id)
    _messages(root, result, chosen, folder / _name(chosen))


def _result(root: Path, student: str, lab: str) -> SubmissionResult:
    from autograder.course.lab import load_lab
    from autograder.grading.store import ResultStore

    found = [result for result in ResultStore(root).all(lab or None) if result.student == student]
    if not found:
        if lab:
            load_lab(root, lab)  # refuses a name that is misspelt
        raise KitError(f"There is no result of {student!r}.", "Grade the class first: autograder grade LAB SUBMISSIONS")
    if len(found) > 1:
        raise KitError(f"{student} has results of {len(found)} labs.", f"Name one: --lab {found[-1].lab}")
    return found[0]


def _name(check: CheckResult) -> str:
    return re.sub(r"[^A-Za-z0-9_-]", "-", check.grade_id)


def pictures(checks: list[CheckResult], folder: Path) -> list[Path]:
    """Write the pictures of checks to files, and return their paths."""
    from autograder.core.files import write_beside

    written = []
    for check in checks:
        pictures = [outcome.picture for outcome in check.outcomes if outcome.picture is not None]
        for number, picture in enumerate(pictures, start=1):
            written.append(folder / f"{_name(check)}_{number}.svg")
            write_beside(written[-1], picture.svg)
    return written


def _in_gradebook(root: Path, result: SubmissionResult) -> None:
    """Show the points of the whole submission if they are not those of its checks."""
    from autograder.gradebook.grades import read_grades
    from autograder.report.terminal import console

    grade = next((one for one in read_grades(root, result.lab) if one.student == result.student), None)
    if grade is None or (grade.earned, grade.max_score) == (result.points, result.max_points):
        return
    told = f"{grade.earned:g} of {grade.max_score:g} points, with what people and rules about lateness decided"
    to_grade = f"; {len(grade.waiting)} to grade" if grade.waiting else ""
    console().print(f"In the gradebook: {told}{to_grade}", markup=False)


def _history(root: Path, result: SubmissionResult, check: str = "") -> None:
    """Show what happened to the points of a submission or of one of its checks."""
    from autograder.core.history import told
    from autograder.gradebook.grades import read_history
    from autograder.report.terminal import console, history_view

    events = told(read_history(root, result.lab, result.student).get(result.student, []), check)
    if events:
        console().print(history_view(events))


def _messages(root: Path, result: SubmissionResult, check: CheckResult, bag: Path) -> None:
    """Run the check again, write the messages that it received, and say whether its result is the same as before."""
    from autograder.core.grades import in_points
    from autograder.course.lab import load_lab
    from autograder.course.paths import CoursePaths
    from autograder.grading.messages import received, write_mcap
    from autograder.grading.runner import Settings
    from autograder.report.terminal import console, working
    from autograder.sandbox.isolation import choose
    from autograder.submission.reader import read_submission

    screen = console()
    lab = load_lab(root, result.lab)
    notebook = CoursePaths(root).submitted_notebook(result.student, lab.name)
    if read_submission(notebook, lab).digest != result.digest:
        screen.print("The submission, the lab or the kit has changed since; these are messages of a new run.")
    settings = Settings(isolation=choose(result.isolation), seed=result.seed)
    with working(f"Running {check.grade_id} again for its messages"):
        again, messages = received(notebook, result.student, lab, settings, [check.grade_id])
    if [one.points for one in again] != [check.points]:
        now = again[0].points if again else None
        screen.print(f"In this second run, the check gives {'no verdict' if now is None else in_points(now)}.")
    if not messages:
        screen.print("The check received no messages.")
        return
    left_out = write_mcap(messages, bag)
    topics = sorted({message.topic for message in messages})
    screen.print(f"{len(messages)} messages on {', '.join(topics)}:", markup=False)
    for name in left_out:
        screen.print(f"Messages of the type {name} are left out because its definition is not installed.", markup=False)
    print(next(bag.glob("*.mcap")))
