"""Attaches the probe: to rclpy once, in the launcher, and to a program's pipe after the fork."""

import atexit
import importlib
from typing import Any

from . import events, rclpy_names, student_lines
from .callbacks import watch_blocking, watch_callbacks, watch_threads
from .watch_actions import watch_actions
from .watch_executors import watch_executors
from .watch_messages import watch_messages
from .watch_nodes import forgotten_returns, watch_lifecycle, watch_nodes, watch_parameters, watch_things
from .writing import emit, ledger, open_channel, quiet

_MODULES = (
    "action", "action.client", "action.server", "client", "executors", "lifecycle", "node", "publisher", "service",
    "timer",
)  # fmt: skip
_PARTS = (
    watch_nodes,
    watch_things,
    watch_executors,
    watch_blocking,
    watch_callbacks,
    watch_messages,
    watch_parameters,
    watch_actions,
    watch_lifecycle,
)
_failed: list[str] = []


def prepare() -> list[str]:
    """Wrap rclpy's functions, and return one sentence for each part of rclpy that cannot be watched."""
    rclpy: Any = importlib.import_module("rclpy")
    for name in _MODULES:
        importlib.import_module(f"rclpy.{name}")
    _failed.extend(rclpy_names.moved(rclpy))
    for part in _PARTS:
        try:
            part(rclpy)
        except Exception as error:
            _failed.append(f"The probe's {part.__name__} does not fit the installed rclpy: {error}.")
    return list(_failed)


def begin(descriptor: int, folder: str, assume_success: bool) -> None:
    """Begin to write to a descriptor. The student's own lines are those of files in `folder`.

    With `assume_success`, a lifecycle callback that returns no TransitionCallbackReturn succeeds all the same.
    """
    open_channel(descriptor)
    forgotten_returns.succeed = assume_success
    student_lines.own_files_are_in(folder)
    for what in _failed:
        emit(events.ProbeFailed(what=what))
    emit(events.Attached())
    with quiet():
        watch_threads()
        atexit.register(ledger.write)


def note_memory_error() -> None:
    """Note that the program ends because it ran out of memory."""
    emit(events.MemoryFailed())
