"""Finds lines in the student's own files: the running line, one that raised or awaits, or where a callback begins."""

import inspect
import linecache
import os
import sys
from typing import Any

from .events import Where


class _Own:
    folder = "\0"
    """The beginning of the path of every student's file."""


def own_files_are_in(folder: str) -> None:
    """Set the folder of the student's files."""
    _Own.folder = folder.rstrip("/") + "/"


def own_line() -> Where:
    """Return the line of the student's own files that this thread is executing."""
    frame: Any = sys._getframe(1)
    while frame is not None:
        if frame.f_code.co_filename.startswith(_Own.folder):
            return _line(frame.f_code.co_filename, frame.f_lineno)
        frame = frame.f_back
    return nowhere()


def error_line(error: BaseException) -> Where:
    """Return the innermost line of the student's files in an exception's traceback.

    If another of the student's files called the file of that line, the line of that call is included.
    """
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
    """Return the line in which a student's callback begins."""
    function = inspect.unwrap(getattr(callback, "__func__", callback))
    code = getattr(function, "__code__", None)
    if code is None or not code.co_filename.startswith(_Own.folder):
        return nowhere()
    return _line(code.co_filename, code.co_firstlineno)


def awaited_line(coroutine: Any) -> tuple[Where, Any]:
    """Return the student's line that awaits something, and the object whose `__await__` is running, if there is one."""
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
    """Return an empty place, which is in none of the student's lines."""
    return Where()


def _line(path: str, number: int) -> Where:
    return Where(line=f"{os.path.basename(path)}:{number}", code=linecache.getline(path, number).strip())
