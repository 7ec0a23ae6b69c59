"""Commands for authors: `new`, `trust`, `lint`, `release`, `kit`, `hub`, `gradescope` and `classroom50`."""

from __future__ import annotations

import shlex
import shutil
import sys
from pathlib import Path
from typing import Annotated

import typer

from autograder.cli.app import CourseOption, IsolationOption, app
from autograder.core.results import Isolation

new = typer.Typer(no_args_is_help=True)
app.add_typer(new, name="new", help="Create a course, or a lab in a course.")


@new.command("course")
def new_course(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="A folder that does not exist yet, or is empty.")],
) -> None:
    """Write a course with its settings and one small lab."""
    from autograder.authoring.courses import FIRST_LAB
    from autograder.authoring.courses import new_course as write
    from autograder.gradebook.own_courses import trust as note

    for path in write(folder):
        print(path)
    try:
        note(folder)
    except OSError as error:
        print(
            f"\nThe folder could not be registered as a course of yours ({error.filename}: {error.strerror}), so"
            f" nbgrader's own commands will ignore its settings. Once it can be written, run: autograder trust {folder}"
        )
    print(f"\nNext:\n  cd {shlex.quote(str(folder))}\n  {_command()} lint {FIRST_LAB}\n  {_command()} release")


def _command() -> str:
    """The kit's command, as it can be typed here."""
    here = str(Path(sys.executable).with_name("autograder"))
    return "autograder" if shutil.which("autograder") else shlex.quote(here)


@app.command()
def trust(folder: Annotated[Path, typer.Argument(metavar="DIR", help="The folder of a course of yours.")]) -> None:
    """Register a folder as a course of yours, so that its nbgrader_config.py, which is a program, may run."""
    from autograder.course.paths import course_root
    from autograder.gradebook.own_courses import trust as note

    root = course_root(folder)
    note(root)
    print(f"{root} is registered as a course of yours.")


@new.command("lab")
def new_lab(
    name: Annotated[str, typer.Argument(help="Lower-case letters, digits and underscores, such as lab2_talkers.")],
    course: CourseOption = None,
) -> None:
    """Write a small, complete lab with checks into the course. You then change it into your own lab."""
    from autograder.authoring.courses import new_lab as write
    from autograder.course.paths import course_root

    for path in write(course_root(course), name):
        print(path)
    where = f" --course {shlex.quote(str(course))}" if course else ""
    print(
        "\nThe lab holds a small example that works: the program `greeter`, a table, and a check"
        "\nfor each. Replace them with your own. Then change requirements.yaml and canaries.yaml,"
        "\nwhich name the example's sentences and answers."
        f"\n\nNext, and after each change:\n  {_command()} lint {name}{where}"
        f"\n  {_command()} release {name}{where}"
    )


@app.command()
def lint(
    lab: Annotated[str | None, typer.Argument(help="The lab; default: all of them.")] = None,
    static: Annotated[bool, typer.Option("--static", help="Only read the lab, and run nothing.")] = False,
    isolation: IsolationOption = Isolation.FULL,
    jobs: Annotated[int, typer.Option(min=1, help="The number of runs at the same time.")] = 4,
    course: CourseOption = None,
) -> None:
    """Find mistakes in a lab: in its cells and checks, in what students would receive, and when it runs."""
    from autograder.authoring.lint.runs import run_findings
    from autograder.authoring.lint.static import course_findings, read_findings, release_findings
    from autograder.course.lab import lab_names, load_lab
    from autograder.course.paths import CoursePaths, course_root
    from autograder.gradebook.release import released_files
    from autograder.grading.canaries import known_answers
    from autograder.sandbox.isolation import choose

    root = course_root(course)
    course_errors = [] if lab else course_findings(root)
    for one in course_errors:
        print(one)
    errors = len(course_errors)
    for name in [lab] if lab else lab_names(root):
        found = read_findings(root, name)
        if not any(not one.warning for one in found):
            found += release_findings(released_files(root, name))
        for one in found:
            print(f"{name}: {one}")
        bad = sum(not one.warning for one in found)
        if not bad and not static:
            read = load_lab(root, name)
            known = known_answers(root, read) if CoursePaths(root).canaries(name).is_file() else []
            for one in run_findings(read, choose(isolation), jobs, known):
                print(f"{name}: {one}")
                bad += not one.warning
        print(f"{name}: {'fine' if not bad else '1 error' if bad == 1 else f'{bad} errors'}")
        errors += bad
    raise typer.Exit(1 if errors else 0)


@app.command()
def release(
    lab: Annotated[str | None, typer.Argument(help="The lab; default: all of them.")] = None,
    course: CourseOption = None,
) -> None:
    """Generate `labs/`, which students receive, from `solutions/`. A lab in which `lint` finds an error is refused."""
    from autograder.authoring.release import START_PAGE, start_page
    from autograder.authoring.release import release as generate
    from autograder.core.files import write_beside
    from autograder.course.lab import lab_names
    from autograder.course.paths import course_root

    root = course_root(course)
    for name in [lab] if lab else lab_names(root):
        print(f"{name} → {generate(root, name)}")
    write_beside(root / "labs" / START_PAGE, start_page(root / "labs"))


@app.command()
def kit(
    book: Annotated[
        Path | None,
        typer.Option(help="A folder with the lectures as HTML; default: build/lectures/book, if it was built."),
    ] = None,
    course: CourseOption = None,
) -> None:
    """Write the student's kit to build/release, as a folder and a zip: labs, a lock, and the kit without solutions."""
    from autograder.authoring.student_kit import write_kit
    from autograder.course.paths import CoursePaths, course_root

    root = course_root(course)
    pages = book or CoursePaths(root).book
    archive = write_kit(root, pages if pages.is_dir() else None, CoursePaths(root).release)
    print(archive)
    if not pages.is_dir():
        print("It contains no lectures because they have not been built. Run `make lectures`, then this command again.")


@app.command()
def hub(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="The folder of the hub, such as /srv/ros2.")],
    course: CourseOption = None,
) -> None:
    """Write the folder from which a JupyterHub serves the course, or bring it up to date. Only root can do this."""
    from autograder.authoring.hub import CONFIGURATION, write_hub
    from autograder.course.paths import CoursePaths, course_root

    root = course_root(course)
    pages = CoursePaths(root).book
    print("\n".join(write_hub(root, pages if pages.is_dir() else None, folder)))
    if not pages.is_dir():
        print(
            "Students get no lectures because they have not been built. Run `make lectures`, then this command again."
        )
    kit = shlex.quote(str(folder.resolve() / "ros2-labs"))
    print(f"\nNext, as root, with a Python that every user may run:\n  make -C {kit} setup PYTHON=/usr/bin/python3")
    print(f"  {kit}/.venv/bin/python -m pip install 'jupyterhub~=6.1' jupyterhub-idle-culler")
    print(f"  {kit}/.venv/bin/jupyterhub -f {shlex.quote(str(folder.resolve() / CONFIGURATION))}")


@app.command()
def gradescope(
    lab: Annotated[str, typer.Argument(help="The lab, such as lab2_executors.")],
    file: Annotated[Path, typer.Argument(metavar="FILE.zip", help="The zip file to write.")],
    course: CourseOption = None,
) -> None:
    """Write a lab's autograder for Gradescope: a zip to upload, which checks each submission when it is handed in."""
    from autograder.authoring.gradescope import write_gradescope
    from autograder.course.paths import course_root

    print(write_gradescope(course_root(course), lab, file))


@app.command()
def classroom50(
    lab: Annotated[str, typer.Argument(help="The lab, such as lab2_executors.")],
    folder: Annotated[
        Path, typer.Argument(metavar="DIR", help="CLASSROOM/autograders/ASSIGNMENT in the classroom's repository.")
    ],
    course: CourseOption = None,
) -> None:
    """Write a lab's autograder for Classroom 50, which checks each submission when it is pushed."""
    from autograder.authoring.classroom50 import write_classroom50
    from autograder.course.paths import course_root

    for path in write_classroom50(course_root(course), lab, folder):
        print(path)
