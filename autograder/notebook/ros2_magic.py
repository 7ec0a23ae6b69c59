"""`%ros2 …`: the command line of ROS 2 in a cell, on the graph of the programs that run."""

from __future__ import annotations

import shlex
from typing import TYPE_CHECKING, Any

from IPython.core.magic import no_var_expand

if TYPE_CHECKING:
    from autograder.notebook.kernel import Kernel

HELP = """Look at the running programs, and speak to them, as with `ros2` in a terminal.

    robot = launch("talker").start()
    %ros2 node list
    %ros2 topic info -v /chatter
    %ros2 topic echo /chatter -n 3
    %ros2 service call /switch std_srvs/srv/SetBool "{data: true}"
    robot.stop()

Inside `with launch(…) as ros:` it looks at that launch. `%ros2 topic --help` names the verbs of a command. What
would go on until Ctrl-C ends after 10 seconds. The exit status is in `_exit_code` afterwards.
"""

_ENDLESS = 10.0
"""Seconds after which a verb is ended that goes on until Ctrl-C: a cell has to end."""
_LONGEST = 60.0
"""Seconds that any other verb may take, such as a call that is not answered."""

_COUNTED = ("--once", "-n", "-t", "--times", "--timeout")


def magic(kernel: Kernel) -> Any:
    """Make the magic."""

    @no_var_expand  # type: ignore[untyped-decorator]
    def ros2(line: str) -> None:
        kernel.shell.user_ns["_exit_code"] = _run(kernel, line)

    ros2.__doc__ = HELP
    return ros2


def _run(kernel: Kernel, line: str) -> int:
    try:
        words = shlex.split(line)
    except ValueError as error:
        print(f"The line cannot be read: {error}. A quotation mark is missing.")
        return 2
    kernel.ready()
    from autograder.checks.runtime import current
    from autograder.ros2.main import TimeIsUp, run

    running = current.running
    looks = bool(words) and words[0] != "interface" and "--help" not in words and "-h" not in words
    if running is None:
        if looks:
            print('No program runs that could be looked at. Start one: robot = launch("NAME").start()')
            return 1
        return run(words or ["--help"])
    for sentence in running.ended_programs() if looks else ():
        print(sentence)
    seconds = _ENDLESS if _is_endless(words) else _LONGEST
    try:
        return run(words or ["--help"], running.observer.domain_id, running.observer, seconds)
    except TimeIsUp:
        print(
            f"(stopped after {seconds:g} s, since a cell has to end; in a terminal it goes on until Ctrl-C)"
            if seconds == _ENDLESS
            else f"(stopped after {seconds:g} s without an answer)"
        )
        return 2


def _is_endless(words: list[str]) -> bool:
    goes_on = words[:1] == ["topic"] and bool({"echo", "hz", "bw", "delay", "pub"} & set(words[1:2]))
    return goes_on and not any(word.startswith(_COUNTED) for word in words)
