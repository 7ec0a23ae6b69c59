"""The command `autograder submit`, which prepares a notebook for handing in."""

from __future__ import annotations

import hashlib
import time
from pathlib import Path
from typing import Annotated

import typer

from autograder.cli.app import app
from autograder.core.errors import KitError
from autograder.core.results import Isolation  # imported here because the command's help lists its values

FOLDER = "handed_in"


@app.command()
def submit(
    notebook: Annotated[Path, typer.Argument(help="The saved notebook to hand in.")],
    lab: Annotated[str | None, typer.Option(help="The lab of the notebook, if its name does not say so.")] = None,
    output: Annotated[
        Path | None, typer.Option("--output", "-o", metavar="DIR", help=f"Where to put the copy; default: {FOLDER}.")
    ] = None,
    without_checks: Annotated[bool, typer.Option("--without-checks", help="Do not run the checks.")] = False,
    isolation: Annotated[
        Isolation | None,
        typer.Option(help="How programs are isolated; default: full, in a student's kit the best that there is."),
    ] = None,
    course: Annotated[
        Path | None, typer.Option(help="The folder of the course whose checks are run; default: the kit's own.")
    ] = None,
) -> None:
    """Copy the saved notebook to the folder that you hand in, warn about what is missing, and print a receipt.

    The copy has the name that grading looks for, and is identical to the notebook. Exit status: 0, whatever the checks
    say; 2 wrong usage or set-up.
    """
    if not notebook.is_file():
        raise KitError(f"There is no notebook {notebook}.", "Name an .ipynb file.")
    from autograder.core.files import write_beside
    from autograder.course.paths import course_root, trusted_course
    from autograder.notebook.hand_in import look_over
    from autograder.report.terminal import console, plain
    from autograder.submission.notebook_file import NOTEBOOK_BYTES, UnreadableError, last_saved
    from autograder.submission.reader import lab_of

    found = lab_of(notebook, lab, trusted_course(course))
    try:
        content = last_saved(notebook).content
    except UnreadableError:  # the warnings say what is wrong with it
        content = notebook.read_bytes()
    if len(content) > NOTEBOOK_BYTES:
        size = f"{notebook} is larger than {NOTEBOOK_BYTES // 1024**2} MiB, and would not be accepted."
        raise KitError(
            size, "Clear all outputs (in JupyterLab: Edit, Clear Outputs of All Cells), save, and submit again."
        )
    folder = output or course_root() / FOLDER
    packed = folder / f"{found.name}.ipynb"
    receipt = packed.with_suffix(".receipt.txt")
    if packed.exists() and not receipt.exists() and not packed.samefile(notebook):
        raise KitError(f"{packed} is another notebook, and no copy that was made to hand in.", "Name another folder.")
    write_beside(packed, content)
    screen = console()
    warnings = look_over(notebook, found, packed).warnings
    for sentence in warnings:
        screen.print(f"! {plain(sentence)}", markup=False)
    lines = [
        f"lab       {found.name}",
        f"packed    {packed}",
        f"time      {time.strftime('%Y-%m-%d %H:%M:%S UTC', time.gmtime())}",
        f"SHA-256   {hashlib.sha256(content).hexdigest()}",
    ]
    if not without_checks:
        lines.append(f"checks    {_checks(packed, found.name, isolation, course, gap=bool(warnings))}")
    write_beside(receipt, "\n".join(lines) + "\n")
    screen.print("\n" + "\n".join(lines), markup=False, soft_wrap=True)
    screen.print(f"\nHand in {packed.name}, and keep {receipt.name}.", markup=False)


def _checks(packed: Path, lab: str, isolation: Isolation | None, course: Path | None, gap: bool) -> str:
    """Run the visible checks on the copy that is handed in, print a line for each, and return the points in words."""
    from autograder.cli.check import checked, isolation_for
    from autograder.course.lab import load_lab
    from autograder.course.paths import trusted_course
    from autograder.course.settings import read_book
    from autograder.grading.runner import Settings
    from autograder.report.terminal import console, summary_view
    from autograder.report.words import total

    root = trusted_course(course)
    found = load_lab(root, lab)
    result = checked(packed, found, Settings(isolation=isolation_for(isolation)), read_book(root))
    if gap:
        console().print()
    console().print(summary_view(result))
    by_hand = found.points_by_hand
    return total(result) + (f" from checks; {by_hand:g} more are for answers that a person grades" if by_hand else "")
