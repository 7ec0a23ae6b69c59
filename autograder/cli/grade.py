"""`autograder grade`: a class."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from autograder.cli.app import CourseOption, ForceOption, IsolationOption, JsonOption, SeedOption, app
from autograder.core.errors import KitError
from autograder.core.results import Isolation
from autograder.course.paths import CoursePaths

if TYPE_CHECKING:
    from autograder.core.grades import Grade
    from autograder.gradebook.class_run import ClassRun

LEFT_OUT = 3
"""The exit status when something that was handed in could not be taken in."""


@app.command()
def grade(
    lab: Annotated[str, typer.Argument(help="The lab, such as lab2_executors.")],
    submissions: Annotated[
        Path | None,
        typer.Argument(
            help="Folder or zip, as your learning platform gives it out, or with a folder for each student;"
            " default: the sample class."
        ),
    ] = None,
    force: ForceOption = False,
    isolation: IsolationOption = Isolation.FULL,
    jobs: Annotated[int, typer.Option(min=0, help="How many run at once; 0 lets the machine decide.")] = 0,
    seed: SeedOption = None,
    as_json: JsonOption = False,
    scheduler: Annotated[
        str, typer.Option(metavar="ADDRESS", help="Send the jobs to the Dask cluster of this scheduler, tcp://…")
    ] = "",
    diff: Annotated[
        bool, typer.Option("--diff", help="Only show what would change, such as after a change of a check.")
    ] = False,
    course: CourseOption = None,
) -> None:
    """Grade a class: gradebook, grades, feedback, and a table of who lost points why.

    Exit status: 0, or 3 if something that was handed in was left out, or 2 if the gradebook lacks a result.
    """
    from autograder.course.folder import course_root
    from autograder.grading.runner import Settings

    root = course_root(course)
    source = submissions or CoursePaths(root).sample_class(lab)
    if not source.exists():
        raise KitError(
            f"There are no submissions at {source}.",
            "Name a folder or zip." if submissions else f"Build the sample class: python tests/sample_class.py {lab}",
        )
    if submissions is None:
        from autograder.authoring.sample_course import sample_course

        root = sample_course(root)
    if root.is_relative_to(source.resolve()):
        raise KitError(
            f"The working folder lies in the submissions, and {root} would be taken for the course.",
            "Change to the folder of your course, and name the submissions from there.",
        )
    from autograder.gradebook.class_run import grade_class, try_class
    from autograder.sandbox.isolation import choose

    settings = Settings(choose(isolation), seed, force, jobs, executor=f"dask://{scheduler}" if scheduler else "")
    if diff:
        from autograder.gradebook.differences import difference_view
        from autograder.report.terminal import console

        console().print(difference_view(try_class(root, lab, source, settings)))
        return
    run = grade_class(root, lab, source, settings)
    _show(run, CoursePaths(root), lab, as_json)
    raise typer.Exit(2 if run.unrecorded else LEFT_OUT if run.collected.refused else 0)


def _show(run: ClassRun, paths: CoursePaths, lab: str, as_json: bool) -> None:
    from autograder.gradebook.settings import gradebook_place
    from autograder.grading.store import ResultStore
    from autograder.report.terminal import class_view, console, plain, undecided_view

    left_out = [plain(sentence) for sentence in (*run.told, *run.collected.notes, *run.collected.refused)]
    left_out += [f"{plain(name)} is not in the gradebook: {plain(why)}" for name, why in run.unrecorded.items()]
    if as_json:
        store = ResultStore(paths.root)
        for number, result in enumerate(run.results):  # one after the other: a class of thousands is large
            whole = store.last(lab, result.student) or result
            print(",\n" if number else "[", whole.model_dump_json(), sep="", end="")
        print("]")
        for sentence in left_out:
            print(sentence, file=sys.stderr)
        return
    screen = console()
    by_hand = {student: _by_hand(grade) for student, grade in run.by_student.items()}
    screen.print(class_view(run.results, by_hand))
    undecided = undecided_view(run.results)
    if undecided is not None:
        screen.print()
        screen.print(undecided)
    screen.print()
    if run.collected.format:
        screen.print(f"Taken as what {run.collected.format} gives out.", markup=False)
    for sentence in left_out:
        screen.print(sentence, markup=False)
    screen.print(_time(len(run.results), run.seconds))
    for label, path in (
        ("gradebook", gradebook_place(paths.root)),
        ("grades", run.grades),
        ("feedback", paths.feedback),
        ("results", paths.results / lab),
    ):
        screen.print(f"{label:<10} {path}", markup=False, soft_wrap=True)


def _by_hand(grade: Grade) -> str:
    """What people gave of what they can give, and what waits for them."""
    cells = [cell for cell in grade.cells if cell.by_hand or cell.points is None or not cell.is_check]
    given = [cell for cell in cells if cell.points is not None]
    most = sum(cell.max_points for cell in cells)
    parts = [f"{sum(cell.points or 0.0 for cell in given):g}/{most:g}"] if given else []
    parts += [f"{len(cells) - len(given)} to grade"] if len(given) < len(cells) else []
    parts += [f"{len(grade.stale)} to look at again"] if grade.stale else []
    return ", ".join(parts)


def _time(submissions: int, seconds: dict[str, float]) -> str:
    after = seconds["all"] - seconds["running"]
    return (
        f"{submissions} submission{'s' * (submissions != 1)} in {seconds['all']:.0f} s:"
        f" {seconds['running']:.0f} s until the last had run, then"
        f" {after:.0f} s more until the last was recorded. nbgrader worked for {seconds['recording']:.0f} s of that."
    )
