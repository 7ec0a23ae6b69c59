"""What one program prints, in the cell that looks on: live, to be folded, warnings and errors in colour."""

from __future__ import annotations

import re
from collections.abc import Sequence
from html import escape
from typing import Any

from autograder.core.output import tidy

LINES = 100
"""Lines of one program that are shown while it runs; `ros.log()` has more."""
_MORE = "[more is in ros.log()]"
_LEVEL = re.compile(r"\[(WARN|ERROR|FATAL)\]")
_COLOUR = {"WARN": "#b35900", "ERROR": "#d55e00", "FATAL": "#d55e00"}
_STYLE = (
    "white-space:pre-wrap; word-break:normal; overflow-wrap:anywhere; margin:0 0 0 18px; color:inherit; font-size:13px"
)


class Stream:
    """The lines of one program in one cell.

    Args:
        program: its name.
        updates: whether what a cell shows can change while it runs; if not, each line is printed once.
    """

    def __init__(self, program: str, updates: bool) -> None:
        """Nothing is shown yet."""
        self._program, self._updates = program, updates
        self._lines: list[str] = []
        self._count = 0
        self._handle: Any = None

    def add(self, text: str) -> None:
        """Show more of what it printed."""
        new = []
        for line in tidy(text).splitlines():
            self._count += 1
            if self._count <= LINES + 1:
                new.append(line if self._count <= LINES else _MORE)
        if not new:
            return
        self._lines += new
        if self._updates:
            self._show()
        else:
            print("\n".join(f"{self._program} | {line}" for line in new))

    def _show(self) -> None:
        from IPython.display import display

        plain = "\n".join(f"{self._program} | {line}" for line in self._lines)
        data = {"text/plain": plain, "text/html": _html(self._program, self._lines)}
        if self._handle is None:
            self._handle = display(data, raw=True, display_id=True)
        else:
            self._handle.update(data, raw=True)


def _html(program: str, lines: Sequence[str]) -> str:
    shown = "\n".join(_coloured(line) for line in lines)
    return (
        f"<details open><summary>Output of <code>{escape(program)}</code></summary>"
        f'<pre style="{_STYLE}">{shown}</pre></details>'
    )


def _coloured(line: str) -> str:
    """A line of the log says its level in words, too."""
    level = _LEVEL.match(line)
    if level is None:
        return escape(line)
    weight = "normal" if level[1] == "WARN" else "bold"
    return f'<span style="color:{_COLOUR[level[1]]}; font-weight:{weight}">{escape(line)}</span>'
