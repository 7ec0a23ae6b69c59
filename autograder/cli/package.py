"""The command `autograder package`, which writes a lab's programs as packages for an installed ROS 2."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from autograder.cli.app import CourseOption, app
from autograder.core.errors import KitError


@app.command()
def package(
    lab: Annotated[str, typer.Argument(help="The lab, such as lab3_remapping.")],
    folder: Annotated[
        Path, typer.Argument(metavar="DIR", help="The folder for the packages, such as the src of a workspace.")
    ],
    notebook: Annotated[
        Path | None, typer.Option(help="The notebook with the programs; default: the lab as students receive it.")
    ] = None,
    course: CourseOption = None,
) -> None:
    """Write a lab's programs and launch files as packages for an installed ROS 2."""
    if notebook is not None and not notebook.is_file():
        raise KitError(f"There is no notebook {notebook}.", "Name an .ipynb file.")
    from autograder.course.lab import load_lab
    from autograder.course.paths import course_root, is_students_kit, trusted_course
    from autograder.packages.ament_package import lab_files, packages_in, write_packages

    # The lab in a student's folder is the student's own notebook.
    found = load_lab(trusted_course(course) if is_students_kit() else course_root(course), lab)
    files = lab_files(found, notebook)
    written = write_packages(found, files, folder)
    names = [*written, *packages_in(files)]
    print("\n".join(str(folder / name) for name in names))
    print(f"\nIn a workspace of an installed ROS 2:\n  colcon build --packages-select {' '.join(names)}")
    print("  source install/setup.bash")
    for name, made in written.items():
        launch = sorted(path.name for path in (made / "launch").glob("*.launch.*"))
        program = min(path.stem for path in (made / name).glob("*.py") if path.stem != "__init__")
        print(f"  ros2 launch {name} {launch[-1]}" if launch else f"  ros2 run {name} {program}")
