"""The command `autograder check`, which checks one notebook."""

from __future__ import annotations

import os
import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, TextIO

import typer

from autograder.cli.app import JsonOption, SeedOption, app
from autograder.core.errors import KitError
from autograder.core.files import signature
from autograder.core.results import Isolation  # imported here because the command's help lists its values

if TYPE_CHECKING:
    from autograder.core.results import SubmissionResult
    from autograder.course.lab import Lab
    from autograder.course.settings import Book
    from autograder.grading.runner import Settings
    from autograder.report.audience import Audience

COULD_NOT_FIND_OUT = 3
"""The exit status if no check failed, but the grader could not decide about at least one."""
_LOOK = 0.3
"""Seconds between two tests whether the notebook was saved."""


@app.command()
def check(
    notebook: Annotated[Path, typer.Argument(help="The notebook to check.")],
    lab: Annotated[str | None, typer.Option(help="The lab of the notebook, if its name does not say so.")] = None,
    as_json: JsonOption = False,
    junit: Annotated[Path | None, typer.Option(help="Also write JUnit XML to this file.")] = None,
    gradescope: Annotated[Path | None, typer.Option(help="Also write Gradescope's results.json to this file.")] = None,
    classroom50: Annotated[
        Path | None, typer.Option(help="Also write Classroom 50's result.json to this file.")
    ] = None,
    instructor: Annotated[bool, typer.Option("--instructor", help="Show what the hidden checks look at.")] = False,
    isolation: Annotated[
        Isolation | None,
        typer.Option(help="How programs are isolated; default: full, in a student's kit the best that there is."),
    ] = None,
    seed: SeedOption = None,
    github: Annotated[
        bool, typer.Option("--github", help="Write annotations and a summary for GitHub Actions.")
    ] = False,
    watch: Annotated[bool, typer.Option("--watch", help="Check again whenever the notebook is saved.")] = False,
    course: Annotated[
        Path | None, typer.Option(help="The folder of the course whose checks are run; default: the kit's own.")
    ] = None,
) -> None:
    """Check one notebook in the same way as grading does, and report what failed and why.

    Exit status: 0 all checks passed; 1 some failed; 2 wrong usage or set-up; 3 none failed, but some are undecided.
    """
    if not notebook.is_file():
        raise KitError(f"There is no notebook {notebook}.", "Name an .ipynb file.")
    from autograder.course.paths import trusted_course
    from autograder.course.settings import read_book
    from autograder.grading.runner import Settings
    from autograder.submission.reader import lab_of

    root = trusted_course(course)
    found, book = lab_of(notebook, lab, root), read_book(root)
    if found.notebook.resolve() == notebook.resolve():
        note = "This notebook is the course's own copy of the lab, so the checks in this notebook are run."
        print(f"note: {note}", file=sys.stderr)
    settings = Settings(isolation=isolation_for(isolation), seed=seed)
    audience: Audience = "instructor" if instructor else "student"
    while True:
        saved = signature(notebook)
        result = checked(notebook, found, settings, book, None if as_json else audience)
        _write_exports(result, audience, junit, gradescope, classroom50)
        if as_json:
            from autograder.report.audience import result_for

            print(result_for(result, audience).model_dump_json(indent=1))
        if github:
            _tell_github(result, audience, notebook, sys.stderr if as_json else sys.stdout)
        if not watch:
            raise typer.Exit(_status(result))
        print(f"Waiting for {notebook} to be saved. Ctrl-C ends it.", file=sys.stderr)
        _wait_for_save(notebook, saved)


def isolation_for(wanted: Isolation | None) -> Isolation:
    """Return the isolation to use.

    In a student's kit, the default is the best isolation that this machine offers. If it is not full, a note says so.

    Raises:
        KitError: this machine does not offer the isolation that was asked for, or full isolation outside of a student's
            kit.
    """
    from autograder.course.paths import is_students_kit
    from autograder.sandbox.isolation import choose, most

    if wanted is not None or not is_students_kit():
        return choose(wanted or Isolation.FULL)
    found, why = most()
    if why:
        print(f"note: programs run with isolation `{found.value}` because {why}.", file=sys.stderr)
    return found


def checked(
    notebook: Path, lab: Lab, settings: Settings, book: Book, audience: Audience | None = None
) -> SubmissionResult:
    """Run the checks on a notebook, and show the progress on a terminal.

    Args:
        notebook: the notebook to check.
        lab: the lab of the notebook.
        settings: how the notebook is run.
        book: the course's lectures, to which the report refers.
        audience: the reader for whom the report is printed while the checks run; None prints no report.
    """
    from autograder.grading.runner import run_submission, workers_for_one
    from autograder.report.terminal import LiveReport, console

    student = notebook.parent.resolve().name
    with LiveReport([check.grade_id for check in lab.checks], audience, book) as report:
        result = run_submission(notebook, student, lab, settings, workers=workers_for_one(), follower=report)
        report.finish(result)
    if audience and lab.points_by_hand:
        more = f"The answers in words, which a person grades, give up to {lab.points_by_hand:g} more."
        console().print(more, highlight=False)
    return result


def _write_exports(
    result: SubmissionResult, audience: Audience, junit: Path | None, gradescope: Path | None, classroom50: Path | None
) -> None:
    """Write the files that were asked for."""
    from autograder.core.files import write_beside
    from autograder.report.export.classroom50 import result_json
    from autograder.report.export.gradescope import results_json
    from autograder.report.export.junit import junit_xml

    if junit is not None:
        write_beside(junit, junit_xml([result], audience))
    if gradescope is not None:
        write_beside(gradescope, results_json(result))
    if classroom50 is not None:
        write_beside(classroom50, result_json(result, os.environ))


def _tell_github(result: SubmissionResult, audience: Audience, notebook: Path, log: TextIO) -> None:
    """Print the annotations, which GitHub reads from the log, and write the summary to the file that GitHub names.

    Args:
        result: the result of the checks.
        audience: the reader of the annotations.
        notebook: the notebook that was checked.
        log: the stream to print to. GitHub reads both standard output and standard error.
    """
    from autograder.report.audience import result_for
    from autograder.report.github import commands, summary

    seen = result_for(result, audience)
    print(commands(seen, notebook), end="", file=log, flush=True)
    place = os.environ.get("GITHUB_STEP_SUMMARY")
    if place:
        with Path(place).open("a", encoding="utf-8") as file:
            file.write(summary(seen))


def _status(result: SubmissionResult) -> int:
    from autograder.core.results import Status

    statuses = {check.status for check in result.checks}
    if result.real_problems or statuses - {Status.PASSED, Status.UNKNOWN}:
        return 1
    return COULD_NOT_FIND_OUT if Status.UNKNOWN in statuses else 0


def _wait_for_save(notebook: Path, saved: tuple[int, ...] | None) -> None:
    """Wait until the notebook has changed and is stable, because an editor may still be writing it."""
    seen = saved
    while True:
        time.sleep(_LOOK)
        before, seen = seen, signature(notebook)
        if seen is not None and seen == before != saved:
            return
