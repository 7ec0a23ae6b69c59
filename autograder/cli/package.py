"""`autograder package`: what a student wrote, for an installed ROS 2."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from autograder.cli.app import CourseOption, app
from autograder.core.errors import KitError


@app.command()
def package(
    lab: Annotated[str, typer.Argument(help="The lab, such as lab3_remapping.")],
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="Where to write it, such as the src of a workspace.")],
    notebook: Annotated[
        Path | None, typer.Option(help="The notebook whose programs are taken; default: the lab as it is handed out.")
    ] = None,
    course: CourseOption = None,
) -> None:
    """Write a lab's programs and launch files as a package for an installed ROS 2."""
    if notebook is not None and not notebook.is_file():
        raise KitError(f"There is no notebook {notebook}.", "Name an .ipynb file.")
    from autograder.course.folder import course_root
    from autograder.course.lab import load_lab
    from autograder.packages.ament_package import lab_files, package_name, packages_in, write_package

    found = load_lab(course_root(course), lab)
    name, files = package_name(found), lab_files(found, notebook)
    written = write_package(name, f"Programs and launch files of {lab}", files, folder)
    print("\n".join(str(folder / package) for package in (name, *packages_in(files))))
    selected = " ".join((name, *packages_in(files)))
    print(f"\nIn a workspace of an installed ROS 2:\n  colcon build --packages-select {selected}")
    launch = sorted(path.name for path in (written / "launch").glob("*.launch.*"))
    program = min(path.stem for path in (written / name).glob("*.py") if path.stem != "__init__")
    start = f"ros2 launch {name} {launch[-1]}" if launch else f"ros2 run {name} {program}"
    print(f"  source install/setup.bash\n  {start}")
