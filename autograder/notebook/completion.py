"""What the tab key offers in a lab's notebook, besides Python: programs to launch, and the words of `%ros2`."""

from __future__ import annotations

import re
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from autograder.notebook.kernel import Kernel

_PROGRAM = re.compile(r"""\b(launch|Program|log|start)\((\s*["'][^"']*["']\s*,)*\s*["']\w*$|^%%node\s+\w*$""")
"""How a line ends, up to the cursor, in which the name of a program is being written."""
_ROS2 = re.compile(r"^\s*%ros2\s")
_ABOUT_NODES = ("node", "param", "lifecycle")


def register(shell: Any, kernel: Kernel) -> None:
    """Add to what a shell completes."""
    from IPython.core.completer import context_matcher

    @context_matcher()  # type: ignore[untyped-decorator]
    def offers(context: Any) -> dict[str, Any]:
        line = context.text_until_cursor.rpartition("\n")[2]
        if _PROGRAM.search(line):
            return _offered(_programs(kernel), context.token, "program")
        if _ROS2.match(line):
            return _offered(_words(line[: len(line) - len(context.token)].split()[1:]), context.token, "ros2")
        return {"completions": []}

    shell.Completer.custom_matchers.append(offers)


def _offered(words: Iterable[str], token: str, kind: str) -> dict[str, Any]:
    """The words that begin so, and nothing of Python's; beside each of them stands what kind it is of."""
    from IPython.core.completer import SimpleCompletion

    found = [SimpleCompletion(word, type=kind) for word in words if word.startswith(token)]
    return {"completions": found, "suppress": True, "ordered": True}


def _programs(kernel: Kernel) -> list[str]:
    """The programs that cells of the saved notebook write, or have written in this kernel."""
    saved = kernel.saved()
    names = {cell.file_name for cell in saved.cells} if saved is not None else set()
    names |= kernel.folder.written.keys()
    return sorted(name.removesuffix(".py") for name in names if name.endswith(".py") and "/" not in name)


def _words(before: list[str]) -> list[str]:
    """The commands, the verbs of a command, and then what is on the graph of the programs that run."""
    from autograder.checks.runtime import current
    from autograder.ros2.main import COMMANDS, verbs_of

    if not before:
        return list(COMMANDS)
    if len(before) == 1:
        return verbs_of(before[0])
    if current.running is None:
        return []
    watched = current.running.observer
    of = {"topic": watched.topics, "service": watched.services, **dict.fromkeys(_ABOUT_NODES, watched.nodes)}
    return sorted(of[before[0]]()) if before[0] in of else []
