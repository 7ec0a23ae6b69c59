"""The command `autograder`: exit status 0 fine, 1 checks failed, 2 usage or set-up error.

Imports stay inside the commands, for `autograder check` shall start at once.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from autograder.errors import KitError
from autograder.results import Isolation

if TYPE_CHECKING:
    from autograder.submission.lab import Lab

app = typer.Typer(
    add_completion=False,
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
    help="Grade ROS 2 labs: run students' nodes in a sandbox and watch the ROS graph.",
)

IsolationOption = Annotated[
    Isolation, typer.Option(help="How programs are kept apart. Where `full` is missing, the command refuses.")
]
ForceOption = Annotated[bool, typer.Option("--force", help="Run again even what did not change.")]
SeedOption = Annotated[int | None, typer.Option(help="Repeat a run with the same varying values.")]
JsonOption = Annotated[bool, typer.Option("--json", help="Print JSON for a program to read.")]


def main() -> None:
    """Run the command; people get sentences, never a traceback."""
    try:
        app()
    except KitError as error:
        print(f"error: {error.what}", file=sys.stderr)
        if error.do:
            print(f"  {error.do}", file=sys.stderr)
        sys.exit(2)
    except KeyboardInterrupt:
        print("\nInterrupted.", file=sys.stderr)
        sys.exit(130)
    except BrokenPipeError:
        sys.exit(1)


@app.command()
def doctor(as_json: JsonOption = False) -> None:
    """Say what this machine offers for grading, and what to do about each lack."""
    from autograder.doctor import run

    raise typer.Exit(run(as_json))


def _lab_of(notebook: Path, name: str | None, root: Path) -> Lab:
    """Return the lab that a notebook answers: by name, by the file's name, or by the grade_ids in it."""
    from autograder.submission.lab import lab_names, load_lab
    from autograder.submission.reader import grade_ids_in

    names = lab_names(root)
    if name is not None or notebook.stem in names:
        return load_lab(root, name or notebook.stem)
    ids = grade_ids_in(notebook)
    labs = [load_lab(root, known) for known in names]
    best = max(labs, key=lambda lab: len(ids & lab.answers.keys()), default=None)
    if best is None or not ids & best.answers.keys():
        raise KitError(
            f"{notebook.name} is no notebook of a lab of this course.",
            f"Name the lab: --lab NAME. Labs in {root}: {', '.join(names) or 'none'}.",
        )
    return best


@app.command()
def check(
    notebook: Annotated[Path, typer.Argument(help="The notebook to check.")],
    lab: Annotated[str | None, typer.Option(help="The lab it answers, where its name does not say.")] = None,
    as_json: JsonOption = False,
    junit: Annotated[Path | None, typer.Option(help="Also write JUnit XML to this file.")] = None,
    instructor: Annotated[bool, typer.Option("--instructor", help="Show what the hidden checks look at.")] = False,
    isolation: IsolationOption = Isolation.FULL,
    seed: SeedOption = None,
) -> None:
    """Check one notebook as grading would, and report what is wrong and why."""
    if not notebook.is_file():
        raise KitError(f"There is no notebook {notebook}.", "Name an .ipynb file.")
    from autograder.course import course_root
    from autograder.grading.stage_a import Settings, run_submission
    from autograder.report.audience import Audience, result_for
    from autograder.results import Status
    from autograder.sandbox.isolation import choose

    found = _lab_of(notebook, lab, course_root(notebook.parent))
    settings = Settings(isolation=choose(isolation), seed=seed)
    result = run_submission(notebook, notebook.parent.resolve().name, found, settings)
    audience: Audience = "instructor" if instructor else "student"
    if junit is not None:
        from autograder.files import write_beside
        from autograder.report.junit import junit_xml

        write_beside(junit, junit_xml([result], audience))
    if as_json:
        print(result_for(result, audience).model_dump_json(indent=1))
    else:
        from autograder.report.terminal import show, submission_view

        show(submission_view(result, audience))
    fine = not result.problems and all(check.status is Status.PASSED for check in result.checks)
    raise typer.Exit(0 if fine else 1)
