"""The Typer application with which the commands are registered, and the options that several commands have."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from autograder.core.results import Isolation

app = typer.Typer(
    add_completion=False,
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
    help="Grade ROS 2 labs: run students' nodes in a sandbox and observe the ROS graph.",
)

IsolationOption = Annotated[
    Isolation, typer.Option(help="How programs are isolated. If the machine does not offer it, the command refuses.")
]
CourseOption = Annotated[
    Path | None,
    typer.Option(help="The folder of the course; default: the course that you are in, otherwise the kit's own."),
]
"""The option of instructors' commands. `check` has its own option, because its default is the kit's own course."""
ForceOption = Annotated[bool, typer.Option("--force", help="Also run submissions that did not change.")]
SeedOption = Annotated[int | None, typer.Option(min=0, help="Use the same random values as the run with this seed.")]
JsonOption = Annotated[bool, typer.Option("--json", help="Print JSON, for programs.")]
