"""What the tab key offers in a lab's notebook, besides Python: programs to launch, and the words of `%ros2`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from autograder.notebook.kernel import Kernel

_PROGRAM = r"""(?s).*\b(launch|Program|log|start)\(\s*(["'][^"']*["']\s*,\s*)*["']\w*$|%%node\s+\w*$"""
"""Where the name of a program is being written, up to the cursor."""

_ABOUT_NODES = ("node", "param", "lifecycle")


def register(shell: Any, kernel: Kernel) -> None:
    """Add to what a shell completes."""
    shell.set_hook("complete_command", lambda _shell, _event: _programs(kernel), re_key=_PROGRAM)
    shell.set_hook("complete_command", lambda _shell, event: _words(event), str_key="%ros2")


def _programs(kernel: Kernel) -> list[str]:
    """The programs that cells of the saved notebook write, or have written in this kernel."""
    saved = kernel.saved()
    names = {cell.file_name for cell in saved.cells} if saved is not None else set()
    names |= kernel.folder.written.keys()
    return sorted(name.removesuffix(".py") for name in names if name.endswith(".py") and "/" not in name)


def _words(event: Any) -> list[str]:
    """The commands, the verbs of a command, and then what is on the graph of the programs that run."""
    from autograder.checks.runtime import current
    from autograder.ros2.main import COMMANDS, verbs_of

    _, *before = event.text_until_cursor[: len(event.text_until_cursor) - len(event.symbol)].split()
    if not before:
        return list(COMMANDS)
    if len(before) == 1:
        return verbs_of(before[0])
    if current.running is None:
        return []
    watched = current.running.observer
    of = {"topic": watched.topics, "service": watched.services, **dict.fromkeys(_ABOUT_NODES, watched.nodes)}
    return sorted(of[before[0]]()) if before[0] in of else []
