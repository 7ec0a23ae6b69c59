"""`autograder doctor`: what this machine offers."""

from __future__ import annotations

import typer

from autograder.cli.app import JsonOption, app


@app.command()
def doctor(as_json: JsonOption = False) -> None:
    """Say what this machine offers for grading, and what to do about each lack."""
    from autograder.cli.doctor import run

    raise typer.Exit(run(as_json))
