"""Lines of the student's own files: which one is being run, raised, awaited, or begins a callback."""

import inspect
import linecache
import os
import sys
from typing import Any

from .events import Where


class _Own:
    folder = "\0"
    """Begins the path of every file of the student's."""


def own_files_are_in(folder: str) -> None:
    """Say where the student's files are."""
    _Own.folder = folder.rstrip("/") + "/"


def own_line() -> Where:
    """Where in the student's own files this thread is."""
    frame: Any = sys._getframe(1)
    while frame is not None:
        if frame.f_code.co_filename.startswith(_Own.folder):
            return _line(frame.f_code.co_filename, frame.f_lineno)
        frame = frame.f_back
    return nowhere()


def error_line(error: BaseException) -> Where:
    """The innermost line of the student's files that an exception has passed, and the one in another file before it."""
    passed: list[tuple[str, int]] = []
    trace = error.__traceback__
    while trace is not None:
        if trace.tb_frame.f_code.co_filename.startswith(_Own.folder):
            passed.append((trace.tb_frame.f_code.co_filename, trace.tb_lineno))
        trace = trace.tb_next
    if not passed:
        return nowhere()
    found = _line(*passed[-1])
    callers = [_line(*one).line for one in passed if one[0] != passed[-1][0]]
    return Where(line=f"{found.line}, called in {callers[-1]}", code=found.code) if callers else found


def callback_line(callback: Any) -> Where:
    """Where a callback of the student's begins."""
    function = inspect.unwrap(getattr(callback, "__func__", callback))
    code = getattr(function, "__code__", None)
    if code is None or not code.co_filename.startswith(_Own.folder):
        return nowhere()
    return _line(code.co_filename, code.co_firstlineno)


def awaited_line(coroutine: Any) -> tuple[Where, Any]:
    """The student's line that awaits, and the object whose `__await__` it has come to, if any."""
    found, target = nowhere(), None
    inner = coroutine
    while inner is not None:
        frame = getattr(inner, "cr_frame", None) or getattr(inner, "gi_frame", None)
        if frame is not None and frame.f_code.co_filename.startswith(_Own.folder):
            found = _line(frame.f_code.co_filename, frame.f_lineno)
        following = getattr(inner, "cr_await", None) or getattr(inner, "gi_yieldfrom", None)
        if following is None and frame is not None:
            target = frame.f_locals.get("self")
        inner = following
    return found, target


def nowhere() -> Where:
    """No line of the student's."""
    return Where()


def _line(path: str, number: int) -> Where:
    return Where(line=f"{os.path.basename(path)}:{number}", code=linecache.getline(path, number).strip())
