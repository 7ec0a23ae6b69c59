"""`autograder ros2`: what the real tool's command line says about a running system."""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer

from autograder.cli.app import app


@app.command("ros2", add_help_option=False, context_settings={"ignore_unknown_options": True})
def ros2_command(
    words: Annotated[list[str] | None, typer.Argument(metavar="COMMAND VERB ...", help="As for `ros2`.")] = None,
) -> None:
    """Look at a running system as `ros2 node|topic|service|param|action|lifecycle|interface` does."""
    raise typer.Exit(ros2(words or ["--help"]))


def real_ros2() -> str | None:
    """The `ros2` of an installed ROS on the PATH, if there is one besides the kit's own."""
    for folder in os.environ.get("PATH", "").split(os.pathsep):
        found = Path(folder) / "ros2"
        if found.is_file() and os.access(found, os.X_OK):
            with found.open("rb") as file:
                if b"autograder" not in file.read(4096):
                    return str(found)
    return None


def ros2(words: Sequence[str]) -> int:
    """Run `ros2 WORDS` on the graph of ROS_DOMAIN_ID, and return its exit status.

    Where an installed ROS has the tool, that runs in place of this process.
    """
    installed = real_ros2()
    if installed is not None:
        os.execv(installed, [installed, *words])
    from autograder.ros2.main import PROFILE, run
    from autograder.sandbox.environment import profile_environment, remove_logs

    os.environ.setdefault("FASTRTPS_DEFAULT_PROFILES_FILE", str(PROFILE))
    os.environ.setdefault("ROS_LOG_DIR", profile_environment()["ROS_LOG_DIR"])

    try:
        return run(words)
    except BrokenPipeError:  # a reader such as `head` has seen enough
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    finally:
        remove_logs()
