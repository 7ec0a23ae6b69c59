"""What a student sees in the notebook while a launch runs: what is waited for, and what the programs print."""

from __future__ import annotations

import functools
import re
import time
from collections.abc import Callable, Sequence
from html import escape
from typing import Any

from autograder.diagnosis import Diagnosis
from autograder.graph.observer import Observer
from autograder.kernel import Kernel
from autograder.report.output import tidy
from autograder.sandbox.nodes import Program

_MUTE = 0.7
"""Seconds of waiting after which a line says what for: most waits are over by then."""
_EACH = 0.25
"""Seconds between two looks at what the programs have printed."""
_LINES = 100
"""Lines of one program that are shown while it runs; `ros.log()` has more."""

_WAITS_FOR = {
    "expect_node": "the node `{}`",
    "expect_no_node": "the node `{}` to go away",
    "expect_topic": "the topic `{}`",
    "expect_no_topic": "the topic `{}` to go away",
    "expect_publisher": "a publisher on `{}`",
    "expect_subscription": "a subscription on `{}`",
    "expect_no_publisher": "the publishers on `{}` to go away",
    "expect_no_subscription": "the subscriptions on `{}` to go away",
    "expect_qos": "an endpoint on `{}`",
    "expect_match": "both ends of `{}`",
    "expect_messages": "messages on `{}`",
    "expect_silence": "silence on `{}`",
    "expect_runs": "runs of callbacks, told on `{}`",
    "expect_overlap": "callbacks that overlap, told on `{}`",
    "expect_no_overlap": "runs of callbacks, told on `{}`",
    "expect_messages_during": "messages on `{}`",
    "expect_service": "the service `{}`",
    "expect_parameter": "the parameters of `{}`",
    "expect_parameter_refused": "the parameters of `{}`",
    "expect_state": "the state of `{}`",
    "expect_transitions": "transitions of `{}`",
    "expect_running": "the program `{}`",
    "expect_exit": "the end of the program `{}`",
    "expect_log": "a line in the log of `{}`",
    "transition": "`{}` to change its state",
    "available_transitions": "an answer of `{}`",
    "state": "the state of `{}`",
    "call": "an answer of `{}`",
    "call_many": "answers of `{}`",
    "get_parameters": "the parameters of `{}`",
    "list_parameters": "the parameters of `{}`",
    "set_parameter": "an answer of `{}`",
    "send_goal": "the action `{}`",
    "publish": "a subscription on `{}`",
    "wait": "what `ros.wait` asks for",
}


class NotLaunchedError(Exception):
    """What a cell launches is not there, or cannot be used. In a notebook it reads as a sentence."""

    def __init__(self, reason: Diagnosis) -> None:
        """Keep what to say."""
        super().__init__(f"{reason.because} {reason.hint}")

    def _render_traceback_(self) -> list[str]:
        """What IPython shows in place of a traceback: the student's line is not the mistake."""
        return [str(self)]


class Watch:
    """Shows what goes on in one launch, from the thread of the cell that waits.

    Args:
        kernel: of the notebook.
        observer: whose waiting gives the occasions to look.
        programs: gives the programs that run.
    """

    def __init__(self, kernel: Kernel, observer: Observer, programs: Callable[[], Sequence[Program]]) -> None:
        """Begin to watch."""
        self._kernel = kernel
        self._programs = programs
        self._streams = not kernel.scored
        self._shown: dict[int, int] = {}
        self._lines: dict[int, int] = {}
        self._sentence, self._since, self._looked = "", 0.0, 0.0
        self._line: Any = None
        self._said = ""
        observer.meanwhile = self.look

    def begin(self, sentence: str) -> bool:
        """Something is waited for from now on; whether nothing else was."""
        if self._sentence:
            return False
        self._sentence, self._since = sentence, time.monotonic()
        return True

    def end(self) -> None:
        """It is there, or will not come."""
        self._sentence = self._said = ""
        if self._line is not None:
            self._line.update({"text/plain": ""}, raw=True)

    def close(self) -> None:
        """The programs have ended: show the rest of what they printed."""
        if self._streams:
            self.print_new(rest=True)

    def look(self) -> None:
        """Show what is new."""
        now = time.monotonic()
        if now - self._looked < _EACH:
            return
        self._looked = now
        if self._streams:
            self.print_new()
        if self._sentence and now - self._since > _MUTE and self._kernel.updates_outputs:
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
        """Print the lines that the programs have printed since; with `rest` also one that has no end yet."""
        for number, program in enumerate(self._programs()):
            if program.truncated():
                continue
            text = program.output()
            new = text[self._shown.get(number, 0) :]
            whole = new if rest else new[: new.rfind("\n") + 1]
            self._shown[number] = self._shown.get(number, 0) + len(whole)
            for line in tidy(whole).splitlines():
                count = self._lines[number] = self._lines.get(number, 0) + 1
                if count <= _LINES:
                    print(f"{program.name} | {line}")
                elif count == _LINES + 1:
                    print(f"{program.name} | [more is in ros.log()]")


def watched(launch: type) -> type:
    """Make the methods of `launch` that wait say what for."""
    for name, sentence in _WAITS_FOR.items():
        setattr(launch, name, _says(getattr(launch, name), sentence))
    return launch


def _says(method: Any, sentence: str) -> Any:
    @functools.wraps(method)
    def call(self: Any, *args: Any, **kwargs: Any) -> Any:
        first = next(iter([*args, *kwargs.values()]), "")
        if self.watch is None or not self.watch.begin(sentence.format(first if isinstance(first, str) else "it")):
            return method(self, *args, **kwargs)
        try:
            return method(self, *args, **kwargs)
        finally:
            self.watch.end()

    return call
