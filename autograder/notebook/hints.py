"""An IPython extension that tells students to run the notebook's set-up cell if they have not done so.

Every kernel of this environment loads it. Otherwise, a check after a restart of the kernel would end with only
`NameError: name 'launch' is not defined`.
"""

from __future__ import annotations

from typing import Any

NAMES = (
    "FULL_NAME", "NAME_OR_NONE", "Program", "World", "answers", "build", "command_line", "launch", "launch_file", "vary"
)  # fmt: skip
"""The names that the set-up cell defines: all names of `autograder.checks`, which this extension does not load."""
_SAY = (
    "Run the first code cell of the notebook, the one with `%load_ext autograder`. It is needed again after every "
    "restart of the kernel, and so are the cells of your programs."
)

STARTED = ("robot", "porter")
"""The names that the labs' cells give to the programs that they start."""


def load_ipython_extension(shell: Any) -> None:
    """Register magics and a hook that print a hint if something fails because the set-up cell was not run."""
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
    if result is None or not isinstance(result.error_in_exec, NameError):
        return
    name = result.error_in_exec.name
    if name in NAMES:
        print(_SAY)
    elif name in STARTED:
        print(
            f"There is no `{name}` yet. Run the last cell above this one that makes it, with "
            f"`{name} = launch(…).start()` or `{name} = launch_file(…).start()`. Then run this cell again."
        )
