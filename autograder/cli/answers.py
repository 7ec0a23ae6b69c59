"""The commands `autograder answers` and `autograder mark`, for answers in words."""

from __future__ import annotations

import shlex
from typing import Annotated

import typer

from autograder.cli.app import CourseOption, app

LabArgument = Annotated[str, typer.Argument(help="The lab, such as lab2_executors.")]
CellArgument = Annotated[str, typer.Argument(help="The question, by the id of its cell.")]


@app.command()
def answers(lab: LabArgument, cell: CellArgument, course: CourseOption = None) -> None:
    """Write a page with all answers to a question, similar ones side by side, and the mark scheme."""
    from autograder.course.lab import load_lab
    from autograder.course.paths import CoursePaths, course_root
    from autograder.gradebook.written_answers import question, written_answers
    from autograder.report.answers_page import write_answers_page

    root = course_root(course)
    found = load_lab(root, lab)
    given = written_answers(root, found, cell)
    page = CoursePaths(root).answers_page(lab, cell)
    print(write_answers_page(page, lab, cell, question(found, cell).solution, given))


@app.command()
def mark(
    lab: LabArgument,
    cell: CellArgument,
    points: Annotated[float, typer.Argument(help="The points for each of the answers.")],
    students: Annotated[list[str], typer.Argument(help="The students, by the names in the gradebook.")],
    comment: Annotated[str, typer.Option(help="What the students read about their answers.")] = "",
    course: CourseOption = None,
) -> None:
    """Give the answers of several students the same points and comment, as formgrader would for each of them."""
    from autograder.core.grades import in_points
    from autograder.course.lab import load_lab
    from autograder.course.paths import course_root
    from autograder.gradebook.renewal import renew_pages
    from autograder.gradebook.written_answers import mark as give

    root = course_root(course)
    before = give(root, load_lab(root, lab), cell, points, students, comment)
    renew_pages(root, lab)
    pages = "Their feedback pages were renewed." if len(before) > 1 else "The feedback page was renewed."
    print(f"{in_points(points)} for {cell}: {', '.join(before)}. {pages}")
    for student, old in before.items():
        if old is not None and old != points:
            who = f"`autograder explain {shlex.quote(student)} --lab {lab}` says who gave them."
            print(f"{student} had {old:g} before. {who}")
