"""The command `autograder appeal`, with which a student asks an instructor to look at a verdict again."""

from __future__ import annotations

import hashlib
from pathlib import Path
from typing import Annotated

import typer

from autograder.cli.app import SeedOption, app
from autograder.core.errors import KitError
from autograder.core.results import Isolation  # imported here because the command's help lists its values


@app.command()
def appeal(
    notebook: Annotated[Path, typer.Argument(help="The notebook that you handed in.")],
    check: Annotated[str, typer.Argument(help="The check: its number, its id, or a part of its title.")],
    sentence: Annotated[str, typer.Argument(help="Why the verdict is wrong, in one sentence.")],
    name: Annotated[str, typer.Option(help="Your name, as on the feedback page; default: the notebook's folder.")] = "",
    lab: Annotated[str | None, typer.Option(help="The lab of the notebook, if its name does not say so.")] = None,
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="The file to write; default: in this folder.")
    ] = None,
    isolation: Annotated[
        Isolation | None,
        typer.Option(help="How programs are isolated; default: full, in a student's kit the best that there is."),
    ] = None,
    seed: SeedOption = None,
    course: Annotated[
        Path | None, typer.Option(help="The folder of the course whose checks are run; default: the kit's own.")
    ] = None,
) -> None:
    """Write a file with which your instructor can run a check of your notebook again, and send it to them.

    It holds your sentence, the notebook without outputs, the check's verdict, its random values, and the messages that
    it received.
    """
    if not notebook.is_file():
        raise KitError(f"There is no notebook {notebook}.", "Name an .ipynb file.")
    from autograder.cli.check import isolation_for
    from autograder.cli.chosen import chosen
    from autograder.core.files import write_beside
    from autograder.course.paths import trusted_course
    from autograder.course.settings import read_book
    from autograder.grading.appeal import ENDING, make_appeal
    from autograder.grading.runner import Settings
    from autograder.report.terminal import check_view, console, working
    from autograder.submission.reader import lab_of

    root = trusted_course(course)
    found = lab_of(notebook, lab, root)
    cell = chosen(found.checks, check, found.name)
    student = name or notebook.resolve().parent.name
    settings = Settings(isolation=isolation_for(isolation), seed=seed)
    with working(f"Running {cell.grade_id}"):
        made = make_appeal(notebook, student, found, cell, sentence, settings)
    console().print(check_view(made.seen, title=cell.title or cell.grade_id, book=read_book(root)))
    content = made.model_dump_json(indent=1) + "\n"
    # An instructor saves the files of many students in one folder.
    path = output or Path(f"{found.name}_{cell.grade_id}_{hashlib.sha256(content.encode()).hexdigest()[:8]}{ENDING}")
    write_beside(path, content)
    print(f"Send this file to your instructor: {path}")
