"""The command `autograder viva`, which prepares short talks with students about their own runs."""

from __future__ import annotations

import random
import sys
from typing import TYPE_CHECKING, Annotated

import typer

from autograder.cli.app import CourseOption, app
from autograder.core.errors import KitError

if TYPE_CHECKING:
    from pathlib import Path

    from autograder.core.results import SubmissionResult


@app.command()
def viva(
    students: Annotated[list[str] | None, typer.Argument(help="The students, by the names in the gradebook.")] = None,
    sample: Annotated[int, typer.Option(min=0, help="Choose this number of students at random, besides those.")] = 0,
    lab: Annotated[str, typer.Option(help="The lab, if several were graded.")] = "",
    course: CourseOption = None,
) -> None:
    """Write a sheet for a talk of five minutes: four questions about a student's own run, with pictures and answers.

    Some checks of the graded submission run again for it, with the same random values. No points change.
    """
    from autograder.authoring.viva import write_sheet
    from autograder.course.lab import load_lab
    from autograder.course.paths import course_root
    from autograder.report.terminal import plain, working

    root = course_root(course)
    without: list[KitError] = []
    for result in _results(root, students or [], sample, lab):
        with working(f"Running checks of {result.student} again"):
            try:
                print(write_sheet(root, load_lab(root, result.lab), result))
            except KitError as error:  # the sheets of the others are still wanted
                without.append(error)
    for missing in without:
        print(f"error: {plain(missing.what)}\n  {plain(missing.do)}", file=sys.stderr)
    if without:
        raise typer.Exit(2)


def _results(root: Path, students: list[str], sample: int, lab: str) -> list[SubmissionResult]:
    """Return the results of the chosen students in one lab."""
    from autograder.course.lab import load_lab
    from autograder.grading.store import ResultStore

    if not students and not sample:
        raise KitError("Nobody was named.", "Name students, or let some be chosen: autograder viva --sample 5")
    graded = ResultStore(root).all(lab or None)
    if not graded:
        if lab:
            load_lab(root, lab)  # refuses a name that is misspelt
        raise KitError("There are no results yet.", "Grade a class first: autograder grade LAB SUBMISSIONS")
    labs = sorted({result.lab for result in graded if not students or result.student in students})
    if len(labs) > 1:
        raise KitError(f"{len(labs)} labs were graded.", f"Name one: --lab {labs[-1]}")
    of_lab = {result.student: result for result in graded if result.lab in labs}
    for student in students:
        if student not in of_lab:
            raise KitError(
                f"There is no result of {student!r}.", "Grade the class first: autograder grade LAB SUBMISSIONS"
            )
    others = sorted(of_lab.keys() - set(students))
    return [of_lab[student] for student in (*students, *random.sample(others, min(sample, len(others))))]
