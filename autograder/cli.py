"""The command `autograder`: exit status 0 fine, 1 checks failed, 2 usage or set-up error.

Imports stay inside the commands, for `autograder check` shall start at once.
"""

from __future__ import annotations

import os
import sys
from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from autograder.bootstrap import SetUpError, refuse_foreign_ros
from autograder.errors import KitError
from autograder.results import Isolation

INTERRUPTED = 130
"""Exit status after Ctrl-C; Typer takes the KeyboardInterrupt and exits with it, saying nothing."""

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
        if sys.argv[1:2] != ["doctor"]:  # which reports it among other things
            refuse_foreign_ros(os.environ)
        app()
    except (KitError, SetUpError) as error:
        from autograder.report.terminal import plain  # a student may have named the file that it is about

        print(plain(f"error: {error.what}"), file=sys.stderr)
        if error.do:
            print(plain(f"  {error.do}"), file=sys.stderr)
        sys.exit(2)
    except (KeyboardInterrupt, SystemExit) as end:
        if isinstance(end, SystemExit) and end.code != INTERRUPTED:
            raise
        print("\nInterrupted.", file=sys.stderr)
        sys.exit(INTERRUPTED)
    except BrokenPipeError:
        sys.exit(1)
    except OSError as error:  # the machine refuses something, which is no defect of the kit
        print(f"error: {error.filename or 'a file'}: {error.strerror or error}", file=sys.stderr)
        print(
            "  See that its folder exists, that you may write there, and that the disk has room.\n"
            '  What another user left in the course\'s folder becomes yours by: sudo chown -R "$USER" build',
            file=sys.stderr,
        )
        sys.exit(2)
    except Exception as error:
        import traceback

        last = traceback.extract_tb(error.__traceback__)[-1]
        print(f"error: {type(error).__name__}: {error}", file=sys.stderr)
        print(f"  This is a defect of the kit ({Path(last.filename).name}:{last.lineno}).", file=sys.stderr)
        sys.exit(2)


@app.command()
def doctor(as_json: JsonOption = False) -> None:
    """Say what this machine offers for grading, and what to do about each lack."""
    from autograder.doctor import run

    raise typer.Exit(run(as_json))


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
    from autograder.course import trusted_course
    from autograder.grading.stage_a import Settings, run_submission
    from autograder.report.audience import Audience, result_for
    from autograder.report.terminal import working
    from autograder.results import Status
    from autograder.sandbox.isolation import choose
    from autograder.submission.reader import lab_of

    found = lab_of(notebook, lab, trusted_course(course))
    if found.notebook.resolve() == notebook.resolve():
        note = "This notebook is the course's own copy of the lab: its checks are run as they stand in it."
        print(f"note: {note}", file=sys.stderr)
    settings = Settings(isolation=choose(isolation), seed=seed)
    with working(f"Running the {len(found.checks)} checks of {found.name}: each waits until its evidence has come"):
        result = run_submission(notebook, notebook.parent.resolve().name, found, settings)
    audience: Audience = "instructor" if instructor else "student"
    if junit is not None:
        from autograder.files import write_beside
        from autograder.report.junit import junit_xml

        write_beside(junit, junit_xml([result], audience))
    if as_json:
        print(result_for(result, audience).model_dump_json(indent=1))
    else:
        from autograder.report.terminal import console, submission_view

        console().print(submission_view(result, audience))
    fine = not result.problems and all(check.status is Status.PASSED for check in result.checks)
    raise typer.Exit(0 if fine else 1)


@app.command()
def grade(
    lab: Annotated[str, typer.Argument(help="The lab, such as lab2_executors.")],
    submissions: Annotated[
        Path | None, typer.Argument(help="Folder or zip with a folder for each student; default: the sample class.")
    ] = None,
    force: ForceOption = False,
    isolation: IsolationOption = Isolation.FULL,
    jobs: Annotated[int, typer.Option(min=0, help="How many run at once; 0 lets the machine decide.")] = 0,
    seed: SeedOption = None,
    as_json: JsonOption = False,
) -> None:
    """Grade a class: gradebook, grades, feedback, and a table of who lost points why."""
    from autograder.course import course_root
    from autograder.grading.stage_a import Settings

    root = course_root()
    source = submissions or root / "build" / "classes" / lab
    if not source.exists():
        raise KitError(
            f"There are no submissions at {source}.",
            "Name a folder or zip." if submissions else f"Build the sample class: python tests/sample_class.py {lab}",
        )
    if root.is_relative_to(source.resolve()):
        raise KitError(
            f"The working folder lies in the submissions, and {root} would be taken for the course.",
            "Change to the folder of your course, and name the submissions from there.",
        )
    from autograder.grading.class_run import grade_class
    from autograder.sandbox.isolation import choose

    run = grade_class(root, lab, source, Settings(choose(isolation), seed, force, jobs))
    from autograder.report.terminal import class_view, console, plain, undecided_view

    left_out = [plain(sentence) for sentence in run.refused]
    left_out += [f"{plain(name)} is not in the gradebook: {plain(why)}" for name, why in run.unrecorded.items()]
    status = 2 if run.unrecorded else 0
    if as_json:
        print("[" + ",\n".join(result.model_dump_json() for result in run.results) + "]")
        for sentence in left_out:
            print(sentence, file=sys.stderr)
        raise typer.Exit(status)
    screen = console()
    screen.print(class_view(run.results))
    undecided = undecided_view(run.results)
    if undecided is not None:
        screen.print()
        screen.print(undecided)
    screen.print()
    for sentence in left_out:
        screen.print(sentence, markup=False)
    screen.print(
        f"{len(run.results)} submissions in {run.seconds['all']:.0f} s ({run.seconds['recording']:.0f} s in nbgrader)"
    )
    for label, path in (
        ("gradebook", root / "build" / "gradebook.db"),
        ("grades", run.grades),
        ("feedback", root / "build" / "feedback"),
        ("results", root / "build" / "results" / lab),
    ):
        screen.print(f"{label:<10} {path}", markup=False, soft_wrap=True)
    raise typer.Exit(status)


@app.command()
def release(
    lab: Annotated[str | None, typer.Argument(help="The lab; default: all of them.")] = None,
) -> None:
    """Generate what students receive: `labs/` from `solutions/`."""
    from autograder.course import course_root
    from autograder.files import write_beside
    from autograder.grading.stage_b import release as generate
    from autograder.submission.lab import lab_names
    from autograder.submission.start_page import START_PAGE, start_page

    root = course_root()
    for name in [lab] if lab else lab_names(root):
        print(f"{name} → {generate(root, name)}")
    write_beside(root / "labs" / START_PAGE, start_page(root / "labs"))


@app.command()
def package(
    lab: Annotated[str, typer.Argument(help="The lab, such as lab3_remapping.")],
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="Where to write it, such as the src of a workspace.")],
    notebook: Annotated[
        Path | None, typer.Option(help="The notebook whose programs are taken; default: the lab as it is handed out.")
    ] = None,
) -> None:
    """Write a lab's programs and launch files as a package for an installed ROS 2."""
    if notebook is not None and not notebook.is_file():
        raise KitError(f"There is no notebook {notebook}.", "Name an .ipynb file.")
    from autograder.course import course_root
    from autograder.package import lab_files, package_name, write_package
    from autograder.submission.lab import load_lab

    found = load_lab(course_root(), lab)
    name = package_name(found)
    written = write_package(name, f"Programs and launch files of {lab}", lab_files(found, notebook), folder)
    print(f"{written}\n\nIn a workspace of an installed ROS 2:\n  colcon build --packages-select {name}")
    launch = sorted(path.name for path in (written / "launch").glob("*.launch.*"))
    program = min(path.stem for path in (written / name).glob("*.py") if path.stem != "__init__")
    start = f"ros2 launch {name} {launch[-1]}" if launch else f"ros2 run {name} {program}"
    print(f"  source install/setup.bash\n  {start}")


@app.command()
def report() -> None:
    """Write the class report, build/report/index.html, from the stored results."""
    from autograder.course import course_root
    from autograder.report.class_page import load_results, write_class_page

    root = course_root()
    results = load_results(root)
    if not results:
        raise KitError("There are no results yet.", "Grade a class first: autograder grade LAB")
    print(write_class_page(root, results))


class ExportFormat(StrEnum):
    """What `autograder export` can write."""

    CSV = "csv"
    JUNIT = "junit"
    GRADESCOPE = "gradescope"


@app.command()
def export(
    form: Annotated[ExportFormat, typer.Argument(metavar="FORMAT", help="csv, junit or gradescope.")],
    lab: Annotated[str | None, typer.Option(help="Only this lab.")] = None,
    output: Annotated[Path | None, typer.Option("--output", "-o", help="File to write; default: print it.")] = None,
) -> None:
    """Export the stored results for another program."""
    from autograder.course import course_root
    from autograder.files import write_beside
    from autograder.report.class_page import load_results
    from autograder.report.export import FORMATS

    results = load_results(course_root(), lab)
    if not results:
        raise KitError("There are no results to export.", "Grade a class first: autograder grade LAB")
    text = FORMATS[form.value](results)
    if output is None:
        print(text, end="")
    else:
        write_beside(output, text)
        print(output)
