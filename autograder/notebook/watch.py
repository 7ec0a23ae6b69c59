"""Shows in the notebook, while a launch runs, what the check waits for and what the programs print."""

from __future__ import annotations

import re
import threading
import time
from collections.abc import Callable, Sequence
from html import escape
from typing import Any

from autograder.core.output import tidy
from autograder.graph.observer import Observer
from autograder.sandbox.running_program import RunningProgram

LINES = 100
"""The number of lines of one program that are shown while it runs; `ros.log()` has more."""
_MORE = "[more is in ros.log()]"
_LEVEL = re.compile(r"\[(WARN|ERROR|FATAL)\]")
_COLOUR = {"WARN": "#b35900", "ERROR": "#d55e00", "FATAL": "#d55e00"}
_STYLE = (
    "white-space:pre-wrap; word-break:normal; overflow-wrap:anywhere; margin:0 0 0 18px; color:inherit; font-size:13px"
)


class Stream:
    """The output of one program in one cell.

    Args:
        program: the name of the program.
        updates: whether the output of a cell can be updated while it runs; if not, each line is printed once.
    """

    def __init__(self, program: str, updates: bool) -> None:
        """Begin without output."""
        self._program, self._updates = program, updates
        self._lines: list[str] = []
        self._count = 0
        self._handle: Any = None

    def add(self, text: str) -> None:
        """Show more output of the program."""
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
    """Return a line as HTML, coloured by its log level. The level is also in the text of the line."""
    level = _LEVEL.match(line)
    if level is None:
        return escape(line)
    weight = "normal" if level[1] == "WARN" else "bold"
    return f'<span style="color:{_COLOUR[level[1]]}; font-weight:{weight}">{escape(line)}</span>'


_MUTE = 0.7
"""The seconds of waiting after which a line says what the check waits for. Most waits are shorter."""
_LOOK_EVERY = 0.25
"""The seconds between two looks at what the programs have printed."""


class Watch:
    """Shows what happens in one launch, from the thread of the waiting cell.

    Args:
        observer: the observer of the launch, which calls `look` while it waits.
        programs: returns the running programs.
        streams: whether their output is shown as it comes.
        updates: whether the output of a cell can be updated while it runs.
    """

    def __init__(
        self, observer: Observer, programs: Callable[[], Sequence[RunningProgram]], streams: bool, updates: bool
    ) -> None:
        """Begin to watch."""
        self._programs = programs
        self._streams, self._updates = streams, updates
        self._shown: dict[int, int] = {}
        self._blocks: dict[int, Stream] = {}
        self._sentence, self._since, self._looked = "", 0.0, 0.0
        self._line: Any = None
        self._said = ""
        observer.meanwhile = self.look

    def begin(self, sentence: str) -> bool:
        """Note what the check waits for from now on. Return False if it already waits for something else."""
        if self._sentence:
            return False
        self._sentence, self._since = sentence, time.monotonic()
        return True

    def end(self) -> None:
        """Note that the wait is over, and remove its line."""
        self._sentence = self._said = ""
        if self._line is not None:
            self._line.update({"text/plain": ""}, raw=True)

    def new_cell(self) -> None:
        """Show what happens from now on in the new cell that has begun."""
        self._line, self._said = None, ""
        self._shown = {number: len(program.output()) for number, program in enumerate(self._programs())}
        self._blocks.clear()

    def close(self) -> None:
        """Show the rest of what the programs printed, because they have ended."""
        if self._streams:
            self.print_new(rest=True)

    def look(self) -> None:
        """Show new output, and what the check waits for."""
        if threading.current_thread() is not threading.main_thread():  # a button waits, which belongs to no cell
            return
        now = time.monotonic()
        if now - self._looked < _LOOK_EVERY:
            return
        self._looked = now
        if self._streams:
            self.print_new()
        if self._sentence and now - self._since > _MUTE and self._updates:
            said = f"Waiting for {self._sentence}: {now - self._since:.0f} s"
            if said != self._said:
                self._said = said
                self._say(said)

    def _say(self, said: str) -> None:
        from IPython.display import display

        html = re.sub(r"`([^`]*)`", r"<code>\1</code>", escape(said))
        data = {"text/plain": said, "text/html": f'<span style="opacity:0.8">{html}</span>'}
        if self._line is None:
            self._line = display(data, raw=True, display_id=True)
        else:
            self._line.update(data, raw=True)

    def print_new(self, rest: bool = False) -> None:
        """Show the lines that the programs have printed since the last call.

        With `rest`, an incomplete last line is shown, too.
        """
        for number, program in enumerate(self._programs()):
            if program.truncated():
                continue
            text = program.output()
            new = text[self._shown.get(number, 0) :]
            whole = new if rest else new[: new.rfind("\n") + 1]
            self._shown[number] = self._shown.get(number, 0) + len(whole)
            if whole:
                name = self._label(number)
                block = self._blocks.setdefault(number, Stream(name, self._updates))
                block.add(whole)

    def _label(self, number: int) -> str:
        """Return the name of a program, with a number if it is not the first with this name."""
        names = [program.name for program in self._programs()[: number + 1]]
        before = names[:number].count(names[number])
        return f"{names[number]} ({before + 1})" if before else names[number]
