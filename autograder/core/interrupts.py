"""Handle interrupts of a notebook's cell, from Jupyter's Interrupt button or from Ctrl-C.

Python raises KeyboardInterrupt between any two of its instructions. In the middle of the kit's work this would leave a
participant, a program or a lock behind, and the next check might fail because of it. An interrupt that arrives while
the cell's own code runs is raised at once. An interrupt that arrives while the kit's code runs waits until the kit
reaches a safe place (`here`), or until the cell's own code runs again.
"""

from __future__ import annotations

import signal
import threading
from types import FrameType
from typing import Any

_AGAIN = 0.1
"""Seconds after which a waiting interrupt is tried again, because the cell's own code may run again by then."""
_KIT = __name__.partition(".")[0]
_SENDS_VALUE = "finish_displayhook"
"""The function of IPython's display hook that sends the value of a cell, which has been formatted before."""


class Interrupted(KeyboardInterrupt):
    """Somebody has interrupted the kit's work for a cell. A notebook shows it as a sentence."""

    def _render_traceback_(self) -> list[str]:
        """Return what IPython shows instead of a traceback through the kit."""
        return [str(self)]


class CellInterrupts:
    """Handles the interrupts of one cell. It is used in the main thread, where Python handles signals.

    Args:
        variables: the global variables of the cells. Code that has these globals belongs to a cell.
    """

    def __init__(self, variables: dict[str, Any]) -> None:
        """Handle all interrupts from now on."""
        self.sentence = ""
        """The sentence that an interrupted cell shows. If it is empty, an interrupt of the cell's own code shows what
        Python shows."""
        self._variables = variables
        self._asked = False
        """Whether an interrupt waits. The handler changes only such flags, because the code that it interrupts may hold
        any lock."""
        self._reminded = False
        """Whether the next signal comes from `_remind` and is no new interrupt."""
        self._sending = threading.Lock()
        self._closing = threading.Event()
        self._before = signal.signal(signal.SIGINT, self._on_interrupt)
        self._reminder = threading.Thread(target=self._remind, name="interrupts", daemon=True)
        self._reminder.start()

    def close(self) -> None:
        """Give interrupts back to the previous handler. Drop one that still waits, because the cell has ended."""
        self._closing.set()
        self._reminder.join()
        signal.signal(signal.SIGINT, self._before)

    def raise_waiting(self) -> None:
        """Raise the waiting interrupt, if there is one.

        Raises:
            Interrupted: an interrupt was waiting.
        """
        if self._asked and threading.current_thread() is threading.main_thread():
            with self._sending:
                self._asked = False
            raise Interrupted(self.sentence or "Interrupted.")

    def _on_interrupt(self, number: int, frame: FrameType | None) -> None:
        reminded, self._reminded = self._reminded, False
        if reminded and not self._asked:
            return  # the interrupt that this signal repeats has been raised in the meantime
        self._asked = not self._in_cell(frame)
        if self._asked:
            return
        if self.sentence:
            raise Interrupted(self.sentence)
        signal.default_int_handler(number, frame)

    def _in_cell(self, frame: FrameType | None) -> bool:
        """Return whether the cell's own code runs, or code that it called. During an import the answer is False.

        The answer is also False while IPython sends the cell's value, because a verdict that a student sees must stand.
        """
        while frame is not None:
            if frame.f_globals is self._variables:
                return True
            if frame.f_code.co_name == _SENDS_VALUE:
                return False
            module = str(frame.f_globals.get("__name__"))
            if module.partition(".")[0] == _KIT or frame.f_code.co_filename.startswith("<frozen importlib"):
                return False
            frame = frame.f_back
        return False

    def _remind(self) -> None:
        """Send a waiting interrupt again: the kit may have returned to the cell without reaching a safe place."""
        while not self._closing.wait(_AGAIN):
            with self._sending:
                if self._asked:
                    self._reminded = True
                    signal.pthread_kill(threading.main_thread().ident or 0, signal.SIGINT)


_active: CellInterrupts | None = None


def begin(variables: dict[str, Any]) -> None:
    """Hold interrupts until a safe place from now on. In grading this is not called, and Python raises them as usual.

    Outside the main thread, where no cell runs, this does nothing.

    Args:
        variables: the global variables of the cells.
    """
    global _active
    if _active is None and threading.current_thread() is threading.main_thread():
        _active = CellInterrupts(variables)


def say(sentence: str) -> None:
    """Set the sentence that the running cell shows if it is interrupted; see `CellInterrupts`."""
    if _active is not None:
        _active.sentence = sentence


def end() -> None:
    """Stop holding interrupts. Kernels also call this in other threads while a cell runs; there it does nothing."""
    global _active
    if threading.current_thread() is threading.main_thread():
        ended, _active = _active, None
        if ended is not None:
            ended.close()


def held() -> bool:
    """Return whether interrupts wait for a safe place of the kit."""
    return _active is not None


def here() -> None:
    """Mark a safe place, such as a wait, where an exception leaves nothing half done.

    Raises:
        Interrupted: somebody has interrupted the cell.
    """
    if _active is not None:
        _active.raise_waiting()
