"""`autograder doctor`, what this machine offers, `jupyter` and `ros2`, what runs on it."""

from __future__ import annotations

from typing import Annotated

import typer

from autograder.cli.app import JsonOption, app


@app.command()
def doctor(as_json: JsonOption = False) -> None:
    """Say what this machine offers for grading, and what to do if something is missing."""
    from autograder.cli.doctor import run

    raise typer.Exit(run(as_json))


@app.command(add_help_option=False, context_settings={"ignore_unknown_options": True})
def jupyter(
    words: Annotated[list[str] | None, typer.Argument(metavar="...", help="Options of `jupyter lab`.")] = None,
) -> None:
    """Open the course's labs in JupyterLab, with the settings that students work with."""
    from autograder.cli.jupyter import open_labs

    open_labs(words or [])


@app.command("ros2", add_help_option=False, context_settings={"ignore_unknown_options": True})
def ros2_command(
    words: Annotated[list[str] | None, typer.Argument(metavar="COMMAND VERB ...", help="The words of `ros2`.")] = None,
) -> None:
    """Look at a running system as `ros2 node|topic|service|param|action|lifecycle|interface` does."""
    from autograder.cli.ros2 import ros2

    raise typer.Exit(ros2(words or []))
