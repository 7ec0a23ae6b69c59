"""The IPython extension that every kernel of this environment has: it says so when a notebook's set-up cell is missing.

After a restart of the kernel a check would end in a bare `NameError: name 'launch' is not defined`.
"""

from __future__ import annotations

from typing import Any

NAMES = ("FULL_NAME", "NAME_OR_NONE", "Program", "answers", "build", "command_line", "launch", "launch_file", "vary")
"""What the set-up cell brings: all names of `autograder.checks`, which this extension does not load."""
_SAY = (
    "Run the first code cell of the notebook, the one with `%load_ext autograder`. It is needed again after every "
    "restart of the kernel, and so are the cells of your programs."
)


def load_ipython_extension(shell: Any) -> None:
    """Add a sentence to what fails because the set-up cell was not run."""
    for magic in ("node", "file"):
        if magic not in shell.magics_manager.magics["cell"]:
            shell.register_magic_function(_not_yet(magic), magic_kind="cell", magic_name=magic)
    for magic in ("lab", "ros2"):
        if magic not in shell.magics_manager.magics["line"]:
            shell.register_magic_function(_not_known, magic_kind="line", magic_name=magic)
    shell.events.register("post_run_cell", _explain)


def _not_yet(magic: str) -> Any:
    def say(line: str, _cell: str) -> None:
        print(f"✗ `{line.strip()}` was not written. {_SAY}")

    say.__doc__ = f"Write the cell to a {'program' if magic == 'node' else 'file'}. {_SAY}"
    return say


def _not_known(_line: str) -> None:
    print(_SAY)


def _explain(result: Any) -> None:
    if result is not None and isinstance(result.error_in_exec, NameError) and result.error_in_exec.name in NAMES:
        print(_SAY)
