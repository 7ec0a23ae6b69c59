"""The commands `autograder doctor`, `autograder jupyter` and `autograder ros2`."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import Annotated

import typer

from autograder.cli.app import CourseOption, JsonOption, app


@app.command()
def doctor(as_json: JsonOption = False, course: CourseOption = None) -> None:
    """Say what this machine offers for grading, and what to do if something is missing."""
    from autograder.cli.doctor import run

    raise typer.Exit(run(as_json, course))


@app.command(add_help_option=False, context_settings={"ignore_unknown_options": True})
def jupyter(
    words: Annotated[list[str] | None, typer.Argument(metavar="...", help="Options of `jupyter lab`.")] = None,
) -> None:
    """Open the course's labs in JupyterLab, with the settings that students work with.

    On a JupyterHub, this is the command that starts a student's server.
    """
    from autograder.core.errors import KitError
    from autograder.course.paths import CoursePaths, course_root, is_students_kit
    from autograder.notebook import JUPYTER_SETTINGS
    from autograder.notebook.hub import is_on_hub, own_labs
    from autograder.setup.labs import put_labs

    # These settings are not installed in the environment, so an instructor who starts `jupyter lab` has formgrader.
    environment = os.environ | {"JUPYTER_CONFIG_PATH": str(JUPYTER_SETTINGS)}
    # Code in a notebook starts the environment's programs by their names alone.
    environment["PATH"] = os.pathsep.join((os.path.dirname(sys.executable), os.environ.get("PATH", os.defpath)))  # noqa: PTH120
    if is_students_kit() and is_on_hub():
        os.chdir(own_labs())
        environment |= {"JUPYTERHUB_ROOT_DIR": str(Path.cwd()), "JUPYTERHUB_DEFAULT_URL": "/lab/tree/README.md"}
        # The hub's own settings come first.
        places = (os.environ.get("JUPYTER_CONFIG_PATH", ""), str(JUPYTER_SETTINGS))
        environment["JUPYTER_CONFIG_PATH"] = os.pathsep.join(filter(None, places))
        os.execve(sys.executable, [sys.executable, "-P", "-m", "jupyterhub.singleuser", *(words or [])], environment)
    if is_students_kit():
        put_labs()
    labs = CoursePaths(course_root()).labs
    if not labs.is_dir():
        raise KitError(f"There are no labs in {labs}.", "Make them from the solutions: autograder release")
    # JupyterLab shows the whole folder of a student's kit, so that the lectures can be opened beside the labs.
    whole = ["--LabApp.default_url=/lab/tree/labs/README.md"] if is_students_kit() else []
    os.chdir(labs.parent if whole else labs)
    root = ["--allow-root"] if os.getuid() == 0 else []
    command = [sys.executable, "-P", "-m", "jupyterlab", *whole, *root, *(words or [])]
    os.execve(sys.executable, command, environment)


@app.command("ros2", add_help_option=False, context_settings={"ignore_unknown_options": True})
def ros2_command(
    words: Annotated[list[str] | None, typer.Argument(metavar="COMMAND VERB ...", help="The words of `ros2`.")] = None,
) -> None:
    """Look at a running system as `ros2 node|topic|service|param|action|lifecycle|interface` does."""
    from autograder.cli.ros2 import ros2

    raise typer.Exit(ros2(words or []))
