"""`autograder check`: one notebook."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import typer

from autograder.cli.app import IsolationOption, JsonOption, SeedOption, app
from autograder.core.errors import KitError
from autograder.core.results import Isolation


@app.command()
def check(
    notebook: Annotated[Path, typer.Argument(help="The notebook to check.")],
    lab: Annotated[str | None, typer.Option(help="The lab it answers, where its name does not say.")] = None,
    as_json: JsonOption = False,
    junit: Annotated[Path | None, typer.Option(help="Also write JUnit XML to this file.")] = None,
    instructor: Annotated[bool, typer.Option("--instructor", help="Show what the hidden checks look at.")] = False,
    isolation: IsolationOption = Isolation.FULL,
    seed: SeedOption = None,
    course: Annotated[
        Path | None, typer.Option(help="The folder of the course whose checks are run; default: the kit's own.")
    ] = None,
) -> None:
    """Check one notebook as grading would, and report what is wrong and why."""
    if not notebook.is_file():
        raise KitError(f"There is no notebook {notebook}.", "Name an .ipynb file.")
    from autograder.core.results import Status
    from autograder.course.folder import trusted_course
    from autograder.grading.runner import WORKERS_FOR_ONE, Settings, run_submission
    from autograder.report.audience import Audience, result_for
    from autograder.report.terminal import working
    from autograder.sandbox.isolation import choose
    from autograder.submission.reader import lab_of

    found = lab_of(notebook, lab, trusted_course(course))
    if found.notebook.resolve() == notebook.resolve():
        note = "This notebook is the course's own copy of the lab: its checks are run as they stand in it."
        print(f"note: {note}", file=sys.stderr)
    settings = Settings(isolation=choose(isolation), seed=seed)
    number = f"the {len(found.checks)} checks" if len(found.checks) > 1 else "the check"
    with working(f"Running {number} of {found.name}: evidence is waited for"):
        result = run_submission(notebook, notebook.parent.resolve().name, found, settings, workers=WORKERS_FOR_ONE)
    audience: Audience = "instructor" if instructor else "student"
    if junit is not None:
        from autograder.core.files import write_beside
        from autograder.report.export.junit import junit_xml

        write_beside(junit, junit_xml([result], audience))
    if as_json:
        print(result_for(result, audience).model_dump_json(indent=1))
    else:
        from autograder.report.terminal import console, submission_view

        console().print(submission_view(result, audience))
    fine = not result.problems and all(check.status is Status.PASSED for check in result.checks)
    raise typer.Exit(0 if fine else 1)
