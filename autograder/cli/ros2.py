"""The command `ros2` in a terminal, which gives the same information about a running system as the real tool."""

from __future__ import annotations

import contextlib
import os
import signal
import sys
from collections.abc import Sequence
from pathlib import Path

from autograder.graph.domains import group_of
from autograder.sandbox.environment import group_environment, profile_environment, remove_logs
from autograder.setup.refusals import SetUpError, refuse_foreign_ros

_TRIED = "AUTOGRADER_ROS2_TRIED"
"""The environment variable that lists each `ros2` that was run instead of the kit's. If such a program only starts the
kit's command again, it is not tried a second time."""


MAX_DOMAIN = 232
"""The largest domain: the ports of larger ones do not exist (DDSI-RTPS 2.3, section 9.6.1)."""


def real_ros2() -> str | None:
    """Return the `ros2` of an installed ROS on the PATH; None if there is only the kit's own, or a script for it."""
    tried = os.environ.get(_TRIED, "").split(os.pathsep)
    for folder in os.environ.get("PATH", "").split(os.pathsep):
        found = Path(folder) / "ros2"
        if str(found) not in tried and found.is_file() and os.access(found, os.X_OK):
            with found.open("rb") as file:
                if b"autograder" not in file.read(4096):
                    return str(found)
    return None


def ros2(words: Sequence[str]) -> int:
    """Run `ros2 WORDS` on the graph of ROS_DOMAIN_ID, and return its exit status.

    If an installed ROS has the tool, that tool replaces this process.
    """
    _join_notebook()
    installed = real_ros2()
    if installed is not None:
        tried = os.pathsep.join(filter(None, [os.environ.get(_TRIED, ""), installed]))
        os.execve(installed, [installed, *words], {**os.environ, _TRIED: tried})
    try:
        refuse_foreign_ros(os.environ)
        _refuse_domain(os.environ.get("ROS_DOMAIN_ID") or "0")
        return _run(words)
    except SetUpError as error:
        print(f"error: {error.what}\n  {error.do}", file=sys.stderr)
        return 2
    except BrokenPipeError:  # the reader, such as `head`, has closed the pipe
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    except KeyboardInterrupt:
        return int(signal.SIGINT)


def _refuse_domain(domain: str) -> None:
    """Look for a domain that the middleware does not have, because the error that it gives is a traceback.

    Raises:
        SetUpError: it is no number, or too large.
    """
    if not (domain.isdecimal() and int(domain) <= MAX_DOMAIN):
        raise SetUpError(
            f"ROS_DOMAIN_ID is {domain!r}.",
            f"Use a number from 0 to {MAX_DOMAIN}, as in `ROS_DOMAIN_ID=7 ros2 node list`.",
        )


def _join_notebook() -> None:
    """Join the multicast group of a notebook if a notebook of this user runs programs in ROS_DOMAIN_ID."""
    with contextlib.suppress(ValueError):  # the tool itself rejects a value that is not a number
        group = group_of(int(os.environ.get("ROS_DOMAIN_ID") or 0))
        if group is not None:
            os.environ.update(group_environment(group))


def _run(words: Sequence[str]) -> int:
    from autograder.ros2.main import PROFILE, run

    os.environ.setdefault("FASTRTPS_DEFAULT_PROFILES_FILE", str(PROFILE))
    os.environ.setdefault("ROS_LOG_DIR", profile_environment()["ROS_LOG_DIR"])
    try:
        return run(words)
    finally:
        remove_logs()
