"""`%ros2 …`: the command line of ROS 2 in a cell, on the graph of the programs that run."""

from __future__ import annotations

import shlex
import sys
from contextlib import redirect_stderr
from typing import TYPE_CHECKING, Any

from IPython.core.magic import no_var_expand

from autograder.graph.names import nearest

if TYPE_CHECKING:
    from autograder.graph.observer import Observer
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
_LONGEST = {"service": 60.0, "action": 60.0}
"""Seconds that the other verbs of a command may take: a call or a goal longer than a question about the graph."""

_ACTION = "/_action/send_goal"
"""How the name of a service ends that takes an action's goals."""

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
        with redirect_stderr(sys.stdout):
            return run(words)
    for sentence in running.news() if looks else ():
        print(sentence)
    endless = _is_endless(words)
    seconds = _ENDLESS if endless else _LONGEST.get("".join(words[:1]), _ENDLESS)
    try:
        with redirect_stderr(sys.stdout):  # what cannot be done is no alarm, and keeps its place
            status = run(words, running.observer.domain_id, running.observer, seconds)
    except TimeIsUp:
        status = 2
        because = "because a cell has to end; in a terminal it goes on until Ctrl-C"
        silent = "because no answer came: a node answers only while something spins it"
        print(f"(stopped after {seconds:g} s, {because if endless else silent})")
    if status and looks:
        _help_on(words[2:], running.observer)
    return status


def _help_on(words: list[str], observer: Observer) -> None:
    """Say which name was probably meant, and whether anybody publishes: the real tool says neither."""
    topics, services = observer.topics(), observer.services()
    actions = [name.removesuffix(_ACTION) for name in services if name.endswith(_ACTION)]
    names = [*observer.nodes(), *topics, *services, *actions]
    for word in words:
        if word in topics and not observer.publishers(word):
            print(f"({word} has no publisher)")
        elif word.startswith("/") and word not in names and (likely := nearest(word, names)):
            print(f"(there is no {word}; the nearest name is {likely})")
        elif f"/{word}" in names:
            print(f"(there is no {word}; a full name begins with a slash: /{word})")


def _is_endless(words: list[str]) -> bool:
    goes_on = words[:1] == ["topic"] and bool({"echo", "hz", "bw", "delay", "pub"} & set(words[1:2]))
    return goes_on and not any(word.startswith(_COUNTED) for word in words)
