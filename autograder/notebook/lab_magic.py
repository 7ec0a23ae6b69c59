"""`%lab`: what of the lab is done and what is open, in one look."""

from __future__ import annotations

import io
from typing import TYPE_CHECKING, Any

from autograder.notebook.lab_state import LabState, lab_state
from autograder.submission.notebook_file import UnreadableError

if TYPE_CHECKING:
    from autograder.notebook.kernel import Kernel

_HELP = """Show what of this lab is done and what is open: points by part, and predictions against measurements.

    %lab

It runs nothing: it shows what the checks said last in this kernel, and says where a cell was run again since.
"""


def magic(kernel: Kernel) -> Any:
    """Make the magic."""

    def lab(line: str) -> None:
        notebook = kernel.folder.notebook
        if notebook is None:
            print("Nobody says here which notebook this is. In a terminal: autograder check NOTEBOOK")
            return
        numbers = {name: written.number for name, written in kernel.folder.written.items()}
        try:
            state = lab_state(notebook, kernel.reports, numbers, kernel.folder.path)
        except UnreadableError as error:
            print(error.problem.because)
            return
        remarks = kernel.remarks(set(kernel.folder.written))
        # A remark may begin with what is said of the notebook's copies anyway.
        state.notes = [note for note in state.notes if not any(one.startswith(note) for one in remarks)] + remarks
        from IPython.display import display

        from autograder.report.html import render

        html = render("lab.html", state=state)
        display({"text/plain": _text(state), "text/html": html}, raw=True)

    lab.__doc__ = _HELP
    return lab


def _text(state: LabState) -> str:
    from rich.console import Console
    from rich.table import Table

    from autograder.report.terminal import plain
    from autograder.report.words import SYMBOL

    screen = Console(file=io.StringIO(), width=100, highlight=False, color_system=None, force_jupyter=False)
    screen.print(plain(f"{state.title}: {state.summary}"), markup=False)
    rows = Table.grid(padding=(0, 1))
    for heading in ("", "title", "said", "points"):
        rows.add_column(heading, no_wrap=heading in ("said", "points"))
    for part in state.parts:
        if part.heading:
            rows.add_row("", plain(part.heading), "", part.points)
        for row in part.rows:
            mark = SYMBOL[row.verdict] if row.verdict else ("✓" if row.done else "○")
            rows.add_row(mark, ("  " if part.heading else "") + plain(row.title), row.said, row.points)
    screen.print(rows)
    for note in state.notes:
        screen.print(plain(f"! {note}"), markup=False)
    if state.next:
        screen.print(plain(f"Go on with: {state.next}"), markup=False)
    if state.guesses:
        guesses = Table.grid(padding=(0, 1))
        for guess in state.guesses:
            guesses.add_row(plain(guess.name), plain(guess.predicted), plain(guess.measured), guess.said)
        screen.print("\nPredicted and measured:")
        screen.print(guesses)
    assert isinstance(screen.file, io.StringIO)
    return "\n".join(line.rstrip() for line in screen.file.getvalue().splitlines())
