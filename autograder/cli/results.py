"""Commands for a graded class: `report`, `export` and `similar`."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from autograder.cli.app import CourseOption, JsonOption, app
from autograder.core.errors import KitError
from autograder.report.export import FORMATS, SEVERAL_LABS  # imported here because the command's help lists all formats

if TYPE_CHECKING:
    from autograder.report.export.entry import Entry, Export

LEFT_OUT = 3
"""The exit status if a student of the class is not in an export."""


@app.command()
def report(course: CourseOption = None) -> None:
    """Write a page about the class for each lab, build/report/LAB.html, for instructors and not for students."""
    import datetime

    from autograder.course.lab import lab_names, load_lab
    from autograder.course.paths import CoursePaths, course_root
    from autograder.gradebook.grades import class_entries, roster_lines
    from autograder.gradebook.renewal import renew_pages
    from autograder.grading.shared_runs import shared_runs
    from autograder.report.class_page import write_class_page

    root = course_root(course)
    renew_pages(root)
    entries = class_entries(root)
    if not entries:
        raise KitError("There are no results yet.", "Grade a class first: autograder grade LAB SUBMISSIONS")
    for lab in sorted({entry.lab for entry in entries}):
        of_lab = [entry for entry in entries if entry.lab == lab]
        students = [entry.student for entry in of_lab]
        shared = shared_runs(root, load_lab(root, lab), students) if lab in lab_names(root) else []
        page, absent = CoursePaths(root).class_page(lab), sorted(roster_lines(root).keys() - set(students))
        print(write_class_page(page, of_lab, datetime.date.today(), shared, absent))


@app.command()
def term(course: CourseOption = None) -> None:
    """Write a page about the whole term, build/report/term.html, for instructors and not for students."""
    import datetime

    from autograder.course.lab import lab_names
    from autograder.course.paths import CoursePaths, course_root
    from autograder.course.settings import read_settings
    from autograder.gradebook.appeals import waiting
    from autograder.gradebook.grades import class_entries, roster_lines
    from autograder.gradebook.renewal import renew_pages
    from autograder.report.term_page import write_term_page

    root = course_root(course)
    renew_pages(root)
    entries, settings = class_entries(root), read_settings(root)
    if not entries:
        raise KitError("There are no results yet.", "Grade a class first: autograder grade LAB SUBMISSIONS")
    page, today = CoursePaths(root).term_page, datetime.date.today()
    appeals, damaged = waiting(root)
    labs, roster = lab_names(root), roster_lines(root)
    if not {entry.lab for entry in entries} & {*labs}:
        graded = ", ".join(sorted({entry.lab for entry in entries}))
        raise KitError(
            f"None of the labs that were graded is in the course any more: {graded}.",
            f"Labs in {root}: {', '.join(labs) or 'none'}.",
        )
    for name in settings.weights.keys() - {*labs}:
        print(f"course.toml gives a weight to `{name}`, which is no lab of this course.", file=sys.stderr)
    print(write_term_page(page, settings.title, entries, labs, settings.weights, appeals, today, roster))
    for sentence in damaged:
        print(sentence, file=sys.stderr)


@app.command()
def export(
    form: Annotated[str, typer.Argument(metavar="FORMAT", help=f"One of: {', '.join(FORMATS)}.")],
    lab: Annotated[str | None, typer.Option(help="Only this lab.")] = None,
    output: Annotated[Path | None, typer.Option("--output", "-o", help="File to write; default: print it.")] = None,
    column: Annotated[
        str, typer.Option(help="The heading of the column in the platform's own export; default: the lab's name.")
    ] = "",
    course: CourseOption = None,
) -> None:
    """Export a graded class for Canvas, Moodle, Blackboard, Gradescope, a CI server or a spreadsheet.

    Exit status: 0, or 3 if somebody is not in the export; the command names them and says why.
    """
    from autograder.core.files import write_beside
    from autograder.course.lab import load_lab
    from autograder.course.paths import course_root
    from autograder.gradebook.grades import class_entries, roster_lines
    from autograder.gradebook.renewal import renew_pages
    from autograder.report.terminal import plain  # students may have chosen their names themselves

    if form not in FORMATS:
        raise KitError(f"There is no format `{form}`.", f"Name one of: {', '.join(FORMATS)}.")
    root = course_root(course)
    if lab is not None:
        load_lab(root, lab)  # a misspelt name is an error
    renew_pages(root, lab)
    entries = class_entries(root, lab)
    if not entries:
        raise KitError("There are no results to export.", "Grade a class first: autograder grade LAB SUBMISSIONS")
    labs = sorted({entry.lab for entry in entries})
    if len(labs) > 1 and form not in SEVERAL_LABS:
        raise KitError(f"The format `{form}` holds only one lab.", f"Name it: --lab LAB, one of {', '.join(labs)}.")
    made = FORMATS[form](entries, column)
    if output is not None:
        write_beside(output, made.content)
        print(plain(_wrote(output, made, entries)))
    elif isinstance(made.content, str):
        print(made.content, end="")
    else:
        raise KitError(f"The format `{form}` is a zip file.", "Name a file for it: --output FILE.zip")
    _say(made.left_out, entries)
    absent = sorted(roster_lines(root).keys() - {entry.student for entry in entries})
    if absent:
        print(plain(f"In the roster, but nothing was graded: {', '.join(absent)}."), file=sys.stderr)
    raise typer.Exit(LEFT_OUT if made.left_out else 0)


def _wrote(output: Path, made: Export, entries: list[Entry]) -> str:
    """Say what an export holds, and of how many students."""
    labs = sorted({entry.lab for entry in entries})
    count = f"{len(entries) - len(made.left_out)} of {len(entries)}" if made.left_out else f"{len(entries)}"
    what = f"student{'s' * (len(entries) != 1)}" if len(labs) == 1 else "submissions"
    return f"{output} holds {count} {what} of {', '.join(labs)}."


def _say(left_out: list[str], entries: list[Entry]) -> None:
    from autograder.report.terminal import plain

    grades = [entry.grade for entry in entries if entry.grade is not None]
    in_words = [sum(not cell.is_check for cell in grade.waiting) for grade in grades]
    if sum(in_words):
        answers = f"{sum(in_words)} answer{'s' * (sum(in_words) != 1)} in words"
        where = f"{sum(map(bool, in_words))} of {len(entries)} submissions"
        print(f"Not graded yet and counted as 0: {answers} in {where}.", file=sys.stderr)
    stale = sum(1 for entry in entries if entry.grade is not None and entry.grade.stale)
    if stale:
        where = f"{stale} of {len(entries)} submissions"
        print(f"In {where}, the work has changed since a person gave points. Look at it again.", file=sys.stderr)
    for sentence in left_out:
        print(plain(sentence), file=sys.stderr)


@app.command()
def similar(
    lab: Annotated[str, typer.Argument(help="The lab, such as lab2_executors.")],
    at_least: Annotated[int, typer.Option(min=1, max=100, help="Smallest similarity to show, in percent.")] = 60,
    most: Annotated[int, typer.Option(min=1, help="How many pairs are shown.")] = 20,
    as_json: JsonOption = False,
    course: CourseOption = None,
) -> None:
    """List pairs of submissions that are similar apart from what the lab hands out. A person has to judge them."""
    import json
    from dataclasses import asdict

    from autograder.course.lab import load_lab
    from autograder.course.paths import CoursePaths, course_root
    from autograder.grading.store import ResultStore
    from autograder.report.terminal import console, similar_view
    from autograder.submission.reader import read_submission
    from autograder.submission.similar import similar as find

    root = course_root(course)
    found = load_lab(root, lab)
    given = {name: answer.blank for name, answer in found.answers.items()}
    students = [result.student for result in ResultStore(root).all(lab)]
    if not students:
        raise KitError("There are no submissions yet.", f"Grade a class first: autograder grade {lab} SUBMISSIONS")
    paths = {student: CoursePaths(root).submitted_notebook(student, lab) for student in students}
    sources = {student: read_submission(path, found).sources for student, path in paths.items()}
    pairs = find(sources, given, at_least / 100)[:most]
    if as_json:
        print(json.dumps([asdict(pair) for pair in pairs], indent=1))
    else:
        console().print(similar_view(pairs, len(students)))
