"""Interrupts of a notebook's cell: Jupyter's Interrupt, or Ctrl-C.

Python raises KeyboardInterrupt between any two of its instructions. In the middle of the kit's work that would leave a
participant, a program or a lock behind, and the next check would pay for it. An interrupt that finds the cell's own
code is raised at once. One that finds the kit at work waits until the kit reaches a safe place (`here`), or until the
cell's own code runs again.
"""

from __future__ import annotations

import signal
import threading
from types import FrameType
from typing import Any

_AGAIN = 0.1
"""Seconds after which an interrupt that found the kit at work is tried again: the cell may have its own code back."""
_KIT = __name__.partition(".")[0]


class Interrupted(KeyboardInterrupt):
    """Somebody has interrupted what the kit did for a cell. In a notebook it reads as a sentence."""

    def _render_traceback_(self) -> list[str]:
        """What IPython shows in place of a traceback through the kit."""
        return [str(self)]


class CellInterrupts:
    """The interrupts of one cell; used in the main thread, which is where Python handles signals.

    Args:
        variables: of the cells: code that has them as its globals is a cell's.
    """

    def __init__(self, variables: dict[str, Any]) -> None:
        """Take the interrupts from now on."""
        self.sentence = ""
        """What a cell says that was interrupted; empty: in code of its own, what Python says."""
        self._variables = variables
        self._asked = False
        """Whether an interrupt waits. All that the handler may touch: whatever it interrupts may hold any lock."""
        self._reminded = False
        """Whether the next signal, or one that is on its way, is no new interrupt."""
        self._sending = threading.Lock()
        self._closing = threading.Event()
        self._before = signal.signal(signal.SIGINT, self._on_interrupt)
        self._reminder = threading.Thread(target=self._remind, name="interrupts", daemon=True)
        self._reminder.start()

    def close(self) -> None:
        """Leave them to whoever had them before. One that still waits came too late: the cell is done."""
        self._closing.set()
        self._reminder.join()
        signal.signal(signal.SIGINT, self._before)

    def raise_waiting(self) -> None:
        """Raise an interrupt that waits.

        Raises:
            Interrupted: there is one.
        """
        if self._asked and threading.current_thread() is threading.main_thread():
            with self._sending:
                self._asked = False
            raise Interrupted(self.sentence or "Interrupted.")

    def _on_interrupt(self, number: int, frame: FrameType | None) -> None:
        reminded, self._reminded = self._reminded, False
        if reminded and not self._asked:
            return  # what this reminds of has been raised meanwhile
        self._asked = not self._in_cell(frame)
        if self._asked:
            return
        if self.sentence:
            raise Interrupted(self.sentence)
        signal.default_int_handler(number, frame)

    def _in_cell(self, frame: FrameType | None) -> bool:
        """Whether the cell's own code runs, or what it has called; an import is never left half done."""
        while frame is not None:
            if frame.f_globals is self._variables:
                return True
            module = str(frame.f_globals.get("__name__"))
            if module.partition(".")[0] == _KIT or frame.f_code.co_filename.startswith("<frozen importlib"):
                return False
            frame = frame.f_back
        return False

    def _remind(self) -> None:
        """Try again what waits: the kit may have returned to the cell's own code without a safe place."""
        while not self._closing.wait(_AGAIN):
            with self._sending:
                if self._asked:
                    self._reminded = True
                    signal.pthread_kill(threading.main_thread().ident or 0, signal.SIGINT)


_active: CellInterrupts | None = None


def begin(variables: dict[str, Any]) -> None:
    """Hold interrupts from now on; without this, as in grading, they come as Python raises them.

    Outside of the main thread, where no cell runs, nothing is done.

    Args:
        variables: of the cells.
    """
    global _active
    if _active is None and threading.current_thread() is threading.main_thread():
        _active = CellInterrupts(variables)


def say(sentence: str) -> None:
    """The cell that runs says this if it is interrupted; see `CellInterrupts`."""
    if _active is not None:
        _active.sentence = sentence


def end() -> None:
    """Hold them no longer. Kernels call it in other threads, too, for requests that come while a cell runs."""
    global _active
    if threading.current_thread() is threading.main_thread():
        ended, _active = _active, None
        if ended is not None:
            ended.close()


def held() -> bool:
    """Whether interrupts wait for the kit's safe places."""
    return _active is not None


def here() -> None:
    """Mark a safe place, such as a wait: an exception raised here leaves nothing half done.

    Raises:
        Interrupted: somebody has interrupted the cell.
    """
    if _active is not None:
        _active.raise_waiting()
