"""The command `autograder grade`, which grades a class."""

from __future__ import annotations

import sys
from collections import Counter
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from autograder.cli.app import CourseOption, ForceOption, IsolationOption, JsonOption, SeedOption, app
from autograder.core.errors import KitError
from autograder.core.results import Isolation
from autograder.course.paths import CoursePaths
from autograder.intake.options import Accepted, FormatName

if TYPE_CHECKING:
    from autograder.core.grades import Grade
    from autograder.core.results import SubmissionResult
    from autograder.gradebook.class_run import ClassRun
    from autograder.intake.collect import Collected

FormatOption = Annotated[
    FormatName | None,
    typer.Option("--format", help="The format of the submissions, if their names fit two formats."),
]
AcceptOption = Annotated[
    list[Accepted] | None,
    typer.Option(
        help="Continue although something stopped the run. smaller: students from the roster or the last run are"
        " missing. replaced: one submission would replace another one. renamed: the roster has a new name for a"
        " student, to which the grades move. roster: somebody is not in the roster."
        " You can give this option several times."
    ),
]
LEFT_OUT = 3
"""The exit status if a part of the submissions was left out or could not be read."""


@app.command()
def grade(
    lab: Annotated[str, typer.Argument(help="The lab, such as lab2_executors.")],
    submissions: Annotated[
        Path | None,
        typer.Argument(
            help="Folder or zip from your learning platform, or a folder or zip with a folder for each student;"
            " default: the sample class."
        ),
    ] = None,
    force: ForceOption = False,
    isolation: IsolationOption = Isolation.FULL,
    jobs: Annotated[int, typer.Option(min=0, help="How many submissions run at once; 0: depends on the CPUs.")] = 0,
    seed: SeedOption = None,
    as_json: JsonOption = False,
    scheduler: Annotated[
        str, typer.Option(metavar="ADDRESS", help="Send the jobs to the Dask cluster of this scheduler, tcp://…")
    ] = "",
    diff: Annotated[
        bool, typer.Option("--diff", help="Only show what would change, for example after you have changed a check.")
    ] = False,
    canaries: Annotated[
        bool,
        typer.Option(help="Run known answers among the class, to detect a machine on which they get other points."),
    ] = True,
    despite_canaries: Annotated[
        bool, typer.Option("--despite-canaries", help="Record the results even if a known answer got other points.")
    ] = False,
    format_name: FormatOption = None,
    accept: AcceptOption = None,
    course: CourseOption = None,
) -> None:
    """Grade a class: write gradebook, grades and feedback, and print who lost points and why.

    Exit status: 0; 2 if nothing was graded because a person has to decide something first, or if a result is missing in
    the gradebook (all are missing if a known answer got other points than it must); 3 if something that was handed in
    was left out or could not be read.
    """
    from autograder.gradebook.class_run import Intake, grade_class, try_class
    from autograder.grading.runner import Settings
    from autograder.sandbox.isolation import choose

    root, source = _places(course, lab, submissions)
    executor = f"dask://{scheduler}" if scheduler else ""
    settings = Settings(choose(isolation), seed, force, jobs, executor, canaries, despite_canaries)
    intake = Intake(format_name.value if format_name else "", accept or (), partial(_show_intake, as_json))
    if diff:
        from autograder.gradebook.differences import difference_view
        from autograder.report.terminal import console

        tried = try_class(root, lab, source, settings, intake)
        console().print(difference_view(tried))
        raise typer.Exit(_status(tried.collected, tried.after, submissions))
    run = grade_class(root, lab, source, settings, intake)
    _show(run, CoursePaths(root), lab, as_json)
    raise typer.Exit(2 if run.unrecorded else _status(run.collected, run.results, submissions))


def _status(collected: Collected, results: Sequence[SubmissionResult], submissions: Path | None) -> int:
    # The sample class contains a student whose notebook cannot be read on purpose.
    return LEFT_OUT if collected.refused or (submissions and _unread(results)) else 0


def _places(course: Path | None, lab: str, submissions: Path | None) -> tuple[Path, Path]:
    """Return the course's folder and the folder or zip of the submissions.

    Raises:
        KitError: there are no submissions, or the course's folder is inside them.
    """
    from autograder.course.lab import load_lab
    from autograder.course.paths import course_root

    root = course_root(course)
    load_lab(root, lab)  # refuses a name that is misspelt, before anything is said about submissions
    source = submissions or CoursePaths(root).sample_class(lab)
    if not source.exists():
        raise KitError(
            f"There are no submissions at {source}.",
            "Name a folder or zip."
            if submissions or not (root / "tests" / "support" / "sample_class.py").is_file()
            else f"Name a folder or zip, or build the sample class: make grade LAB={lab}",
        )
    if submissions is None:
        from autograder.authoring.courses import sample_course

        root = sample_course(root)
    if root.is_relative_to(source.resolve()):
        raise KitError(
            f"The working folder is inside the submissions, so {root} would be used as the course.",
            "Change to the folder of your course, and name the submissions from there.",
        )
    return root, source


def _show_intake(as_json: bool, collected: Collected) -> None:
    """Print what was taken in, before the class is run."""
    from autograder.report.terminal import console, plain

    if as_json:
        print(plain(collected.line), file=sys.stderr)
    else:
        console().print(plain(collected.line), markup=False, soft_wrap=True)


def _unread(results: Sequence[SubmissionResult]) -> list[str]:
    """Return sentences about students whose notebooks could not be read, so that a person has to look at them."""
    from autograder.grading.runner import not_understood

    reasons = {result.student: not_understood(result) for result in results}
    return [
        f"{student}: {why} There are no points yet, because a person decides."
        for student, why in reasons.items()
        if why
    ]


def _show(run: ClassRun, paths: CoursePaths, lab: str, as_json: bool) -> None:
    from autograder.course.lab import load_lab
    from autograder.gradebook.settings import gradebook_place
    from autograder.grading.shared_runs import shared_runs, told
    from autograder.grading.store import ResultStore
    from autograder.report.terminal import class_view, console, plain, undecided_view

    students = [result.student for result in run.results]
    shared = [told(group) for group in shared_runs(paths.root, load_lab(paths.root, lab), students)]
    left_out = [plain(sentence) for sentence in (*run.told, *run.collected.notes, *run.collected.refused)]
    left_out += map(plain, _unread(run.results))
    left_out += [f"{plain(name)} is not in the gradebook: {plain(why)}" for name, why in run.unrecorded.items()]
    if as_json:
        store = ResultStore(paths.root)
        for number, result in enumerate(
            run.results
        ):  # one after the other, because a class of thousands needs much memory
            whole = store.last(lab, result.student) or result
            print(",\n" if number else "[", whole.model_dump_json(), sep="", end="")
        print("]")
        for sentence in (*left_out, *map(plain, shared), *run.canaries):
            print(sentence, file=sys.stderr)
        return
    screen = console()
    by_hand = {student: _by_hand(grade) for student, grade in run.by_student.items()}
    screen.print(class_view(run.results, by_hand, screen.width))
    undecided = undecided_view(run.results, shared)
    if undecided is not None:
        screen.print()
        screen.print(undecided)
    screen.print()
    for sentence in left_out:
        screen.print(sentence, markup=False)
    for sentence in run.canaries:
        screen.print(sentence, markup=False)
    for sentence in _to_grade(run, lab):
        screen.print(sentence, markup=False)
    if any(result.run_again for result in run.results):
        screen.print(_run_again(run.results))
    screen.print(_time(len(run.results), run.seconds))
    for label, path in (
        ("gradebook", gradebook_place(paths.root)),
        ("grades", run.grades),
        ("feedback", paths.feedback),
        ("results", paths.results / lab),
    ):
        screen.print(f"{label:<10} {path}", markup=False, soft_wrap=True)


def _by_hand(grade: Grade) -> str:
    """Say how many points people gave of those that they can give, and what they still have to grade."""
    cells = [cell for cell in grade.cells if cell.by_hand or cell.points is None or not cell.is_check]
    given = [cell for cell in cells if cell.points is not None]
    most = sum(cell.max_points for cell in cells)
    parts = [f"{sum(cell.points or 0.0 for cell in given):g}/{most:g}"] if given else []
    parts += [f"{len(cells) - len(given)} to grade"] if len(given) < len(cells) else []
    parts += [f"{len(grade.stale)} to look at again"] if grade.stale else []
    return ", ".join(parts)


def _to_grade(run: ClassRun, lab: str) -> list[str]:
    """Say which answers in words nobody has graded yet, and which command shows them."""
    cells = [cell.grade_id for grade in run.by_student.values() for cell in grade.waiting if not cell.is_check]
    return [
        f"{count} answer{'s' * (count != 1)} to `{cell}` wait{'s' * (count == 1)} for a person:"
        f" autograder answers {lab} {cell}"
        for cell, count in Counter(cells).items()
    ]


def _run_again(results: Sequence[SubmissionResult]) -> str:
    """Say how many checks were run again because the machine was busy, and how many of them are decided now."""
    checks = [check for result in results for check in result.checks]
    again = [check for check in checks if check.run_again]
    unknown = sum(check.points is None for check in again)
    decided = f"{unknown} of them are still undecided." if unknown else "all of them are decided now."
    return (
        f"{len(again)} of {len(checks)} checks ({len(again) / len(checks):.1%}) lost points while other processes kept"
        f" their programs from the CPUs, and were run again; {decided}"
    )


def _time(submissions: int, seconds: dict[str, float]) -> str:
    after = seconds["all"] - seconds["running"]
    return (
        f"{submissions} submission{'s' * (submissions != 1)} in {seconds['all']:.0f} s:"
        f" {seconds['running']:.0f} s until the last had run, then"
        f" {after:.0f} s more until the last was recorded. nbgrader worked for {seconds['recording']:.0f} s of that."
    )
