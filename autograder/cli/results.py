"""Commands that show the stored results: `report` and `export`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from autograder.cli.app import app
from autograder.core.errors import KitError
from autograder.report.export import FORMATS  # small, and the command's help names them all


@app.command()
def report() -> None:
    """Write the class report, build/report/index.html, from the stored results."""
    from autograder.course.folder import course_root
    from autograder.course.paths import CoursePaths
    from autograder.grading.store import ResultStore
    from autograder.report.class_page import write_class_page

    root = course_root()
    results = ResultStore(root).all()
    if not results:
        raise KitError("There are no results yet.", "Grade a class first: autograder grade LAB")
    print(write_class_page(CoursePaths(root).report, results))


@app.command()
def export(
    form: Annotated[str, typer.Argument(metavar="FORMAT", help=f"One of: {', '.join(FORMATS)}.")],
    lab: Annotated[str | None, typer.Option(help="Only this lab.")] = None,
    output: Annotated[Path | None, typer.Option("--output", "-o", help="File to write; default: print it.")] = None,
) -> None:
    """Export the stored results for another program."""
    from autograder.core.files import write_beside
    from autograder.course.folder import course_root
    from autograder.grading.store import ResultStore

    if form not in FORMATS:
        raise KitError(f"There is no format `{form}`.", f"Name one of: {', '.join(FORMATS)}.")
    results = ResultStore(course_root()).all(lab)
    if not results:
        raise KitError("There are no results to export.", "Grade a class first: autograder grade LAB")
    text = FORMATS[form](results)
    if output is None:
        print(text, end="")
    else:
        write_beside(output, text)
        print(output)
