"""The features of a lab's notebook besides checks: `%ros2`, `%lab`, and completion with the tab key."""

from __future__ import annotations

import io
import re
import shlex
import sys
from collections.abc import Iterable
from contextlib import redirect_stderr
from typing import TYPE_CHECKING, Any

from IPython.core.magic import no_var_expand

from autograder.graph.names import nearest
from autograder.notebook.lab_state import LabState, lab_state
from autograder.notebook.program_folder import RENAMED
from autograder.submission.notebook_file import UnreadableError

if TYPE_CHECKING:
    from autograder.graph.observer import Observer
    from autograder.notebook.kernel import Kernel

_ROS2_HELP = """Look at the running programs and call them, as with `ros2` in a terminal.

    robot = launch("talker").start()
    %ros2 node list
    %ros2 topic info -v /chatter
    %ros2 topic echo /chatter -n 3
    %ros2 service call /switch std_srvs/srv/SetBool "{data: true}"
    robot.stop()

Inside `with launch(…) as ros:` it looks at that launch. `%ros2 topic --help` lists the verbs of a command. A verb that
would run until Ctrl-C is stopped after 10 seconds. Afterwards, the exit status is in `_exit_code`.
"""

_ENDLESS = 10.0
"""The seconds after which a verb that would run until Ctrl-C is ended, because a cell has to end."""
_LONGEST = {"service": 60.0, "action": 60.0}
"""The seconds that the other verbs of a command may take. A call or a goal takes longer than a query of the graph."""

_ACTION = "/_action/send_goal"
"""The end of the name of the service that accepts an action's goals."""

_COUNTED = ("--once", "-n", "-t", "--times", "--timeout")


def ros2_magic(kernel: Kernel) -> Any:
    """Return the magic `%ros2`: the command line of ROS 2 in a cell, on the graph of the running programs."""

    @no_var_expand  # type: ignore[untyped-decorator]
    def ros2(line: str) -> None:
        kernel.shell.user_ns["_exit_code"] = _run_ros2(kernel, line)

    ros2.__doc__ = _ROS2_HELP
    return ros2


def _run_ros2(kernel: Kernel, line: str) -> int:
    try:
        words = shlex.split(line)
    except ValueError as error:
        print(f"The line cannot be parsed: {error}. Probably a quotation mark is missing.")
        return 2
    kernel.ready()
    from autograder.checks import current
    from autograder.ros2.main import TimeIsUp, run

    running = current.check.running
    looks = bool(words) and words[0] != "interface" and "--help" not in words and "-h" not in words
    if running is None:
        if looks:
            print('No program is running. Start one: robot = launch("NAME").start()')
            return 1
        with redirect_stderr(sys.stdout):
            return run(words)
    for sentence in running.news() if looks else ():
        print(sentence)
    endless = _is_endless(words)
    seconds = _ENDLESS if endless else _LONGEST.get("".join(words[:1]), _ENDLESS)
    try:
        with redirect_stderr(sys.stdout):  # so that errors are not highlighted, and stay in the order of the output
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
    """Print which name was probably meant, or that a topic has no publisher, because the real tool says neither."""
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


_LAB_HELP = """Show which parts of this lab are done and which are open, with their points, and compare predictions and
measurements.

    %lab

It runs nothing. It shows the last report of each check in this kernel, and says if a cell was run again after it.
"""


def lab_magic(kernel: Kernel) -> Any:
    """Return the magic `%lab`, which shows which parts of the lab are done and which are open."""

    def lab(line: str) -> None:
        notebook = kernel.folder.notebook
        if notebook is None:
            print(f"The kit does not know this notebook. {RENAMED} Or run in a terminal: autograder check NOTEBOOK")
            return
        numbers = {name: written.number for name, written in kernel.folder.written.items()}
        try:
            state = lab_state(notebook, kernel.reports, numbers, kernel.folder.path)
        except UnreadableError as error:
            renamed = "" if notebook.is_file() else f" {RENAMED}"
            print(f"{error.problem.because}{renamed}")
            return
        remarks = kernel.remarks(set(kernel.folder.written))
        # A note about copies of cells is left out if a remark begins with the same text.
        state.notes = [note for note in state.notes if not any(one.startswith(note) for one in remarks)] + remarks
        from IPython.display import display

        from autograder.report.html import render

        html = render("lab.html", state=state)
        display({"text/plain": _lab_text(state), "text/html": html}, raw=True)

    lab.__doc__ = _LAB_HELP
    return lab


def _lab_text(state: LabState) -> str:
    from rich.console import Console
    from rich.table import Table

    from autograder.report.terminal import plain
    from autograder.report.words import SYMBOL

    screen = Console(file=io.StringIO(), width=100, highlight=False, color_system=None, force_jupyter=False)
    screen.print(plain(f"{state.title}: {state.summary}"), markup=False)
    rows = Table.grid(padding=(0, 1))
    for heading in ("", "title", "said", "points"):
        rows.add_column(heading, no_wrap=heading in ("said", "points"))
    for part in state.parts:
        if part.heading:
            rows.add_row("", plain(part.heading), "", part.points)
        for row in part.rows:
            mark = SYMBOL[row.verdict] if row.verdict else ("✓" if row.done else "○")
            rows.add_row(mark, ("  " if part.heading else "") + plain(row.title), row.said, row.points)
    screen.print(rows)
    for note in state.notes:
        screen.print(plain(f"! {note}"), markup=False)
    if state.next:
        screen.print(plain(f"Go on with: {state.next}"), markup=False)
    if state.guesses:
        guesses = Table.grid(padding=(0, 1))
        for guess in state.guesses:
            guesses.add_row(plain(guess.name), plain(guess.predicted), plain(guess.measured), guess.said)
        screen.print("\nPredicted and measured:")
        screen.print(guesses)
    assert isinstance(screen.file, io.StringIO)
    return "\n".join(line.rstrip() for line in screen.file.getvalue().splitlines())


_PROGRAM = re.compile(r"""\b(launch|Program|log|start)\((\s*["'][^"']*["']\s*,)*\s*["']\w*$|^%%node\s+\w*$""")
"""The end of a line up to the cursor if the name of a program is being typed there."""
_ROS2 = re.compile(r"^\s*%ros2\s")
_ABOUT_NODES = ("node", "param", "lifecycle")


def register_completion(shell: Any, kernel: Kernel) -> None:
    """Add completions of the kit to a shell."""
    from IPython.core.completer import context_matcher

    @context_matcher()  # type: ignore[untyped-decorator]
    def offers(context: Any) -> dict[str, Any]:
        line = context.text_until_cursor.rpartition("\n")[2]
        if _PROGRAM.search(line):
            return _offered(_programs(kernel), context.token, "program")
        if _ROS2.match(line):
            return _offered(_ros2_words(line[: len(line) - len(context.token)].split()[1:]), context.token, "ros2")
        return {"completions": []}

    shell.Completer.custom_matchers.append(offers)


def _offered(words: Iterable[str], token: str, kind: str) -> dict[str, Any]:
    """Return the words that begin with the token as the only completions, each with its kind."""
    from IPython.core.completer import SimpleCompletion

    found = [SimpleCompletion(word, type=kind) for word in words if word.startswith(token)]
    return {"completions": found, "suppress": True, "ordered": True}


def _programs(kernel: Kernel) -> list[str]:
    """Return the programs that cells of the saved notebook write, or that cells have written in this kernel."""
    saved = kernel.saved()
    names = {cell.file_name for cell in saved.cells} if saved is not None else set()
    names |= kernel.folder.written.keys()
    return sorted(name.removesuffix(".py") for name in names if name.endswith(".py") and "/" not in name)


def _ros2_words(before: list[str]) -> list[str]:
    """Return the possible next words of a `%ros2` line: commands, verbs, or names on the running programs' graph."""
    from autograder.checks import current
    from autograder.ros2.main import COMMANDS, verbs_of

    if not before:
        return list(COMMANDS)
    if len(before) == 1:
        return verbs_of(before[0])
    if current.check.running is None:
        return []
    watched = current.check.running.observer
    of = {"topic": watched.topics, "service": watched.services, **dict.fromkeys(_ABOUT_NODES, watched.nodes)}
    return sorted(of[before[0]]()) if before[0] in of else []
