"""Becoming a program: a forked process turns into the one that `python NAME.py` would be, and runs the file."""

import builtins
import contextlib
import ctypes
import fcntl
import importlib
import linecache
import os
import signal
import sys
import threading
import time
import traceback
import types
from types import FrameType
from typing import Any

from .kernel import PR_SET_DUMPABLE, filter_calls, limit, prctl
from .probe import attach
from .requests import Start
from .thread_stacks import answer

_SHUT_DOWN_WITHIN = 1.0
"""Seconds that are given to rclpy's thread, which takes milliseconds."""


def interrupt(number: int, frame: FrameType | None) -> None:
    """Raise KeyboardInterrupt, as Python does, once rclpy has done what it does at this signal.

    At SIGINT a thread of rclpy's shuts the context down, while Python raises KeyboardInterrupt in the main thread.
    Whichever comes second finds the work done. So `rclpy.shutdown()` after the exception mostly fails and sometimes
    does not, and even `rclpy.try_shutdown()` fails once in a while, between its question and its deed. Here the
    shutdown always comes first.
    """
    with contextlib.suppress(Exception):
        deadline = time.monotonic() + _SHUT_DOWN_WITHIN
        while _about_to_shut_down() and time.monotonic() < deadline:
            time.sleep(0.002)
    signal.default_int_handler(number, frame)


def _about_to_shut_down() -> bool:
    """Whether rclpy handles the signal, and its default context is still up.

    Without a lock: the main thread may hold any of them while this interrupts it.
    """
    signals, utilities = sys.modules.get("rclpy.signals"), sys.modules.get("rclpy.utilities")
    context = getattr(utilities, "g_default_context", None)
    if signals is None or context is None or context.handle is None:
        return False
    handled = signals.get_current_signal_handlers_options()
    options = signals.SignalHandlerOptions
    return handled in (options.ALL, options.SIGINT) and bool(context.handle.ok())


_EVENTS, _STACKS = 3, 4
"""The descriptors that the probe and the stacks are written to."""

_OWN = os.path.dirname(os.path.abspath(__file__)) + os.sep


def become(start: Start) -> None:
    """Turn this forked child into the process that the program expects: descriptors, limits, environment."""
    os.setsid()
    if not start.hidden:
        prctl(PR_SET_DUMPABLE, 1)
    _take_descriptors(start)
    with contextlib.suppress(OSError):
        os.sched_setaffinity(0, start.cpus)
    if len(start.cpus) < start.cores:  # rclpy takes as many threads as this says: the same number on every machine
        pretended = set(range(start.cores))
        os.sched_getaffinity = lambda _pid: pretended
    os.cpu_count = lambda: start.cores  # it counts the machine's CPUs otherwise, whatever the process may use
    os.environ.clear()
    os.environ.update(start.env)
    os.chdir(start.folder)
    for name, value in start.limits.items():
        limit(name, value)
    sys.stdin = open(0, closefd=False)
    sys.stdout = open(1, "w", encoding="utf-8", errors="backslashreplace", buffering=1, closefd=False)
    sys.stderr = open(2, "w", encoding="utf-8", errors="backslashreplace", buffering=1, closefd=False)
    vars(sys).update(__stdin__=sys.stdin, __stdout__=sys.stdout, __stderr__=sys.stderr)
    signal.signal(signal.SIGINT, interrupt)
    filter_calls(start.filter)
    answer(_STACKS)


def _take_descriptors(start: Start) -> None:
    """Put the program's descriptors where it looks for them, and close all others."""
    spare = [os.dup(descriptor) for descriptor in (start.output, start.events, start.stacks)]
    nothing = os.open(os.devnull, os.O_RDONLY)
    moved = [fcntl.fcntl(descriptor, fcntl.F_DUPFD_CLOEXEC, 64) for descriptor in (nothing, *spare)]
    os.dup2(moved[0], 0)
    os.dup2(moved[1], 1)
    os.dup2(moved[1], 2)
    os.dup2(moved[2], _EVENTS, inheritable=False)
    os.dup2(moved[3], _STACKS, inheritable=False)
    os.closerange(_STACKS + 1, 4096)


def run(start: Start) -> None:
    """Run the program as `python NAME.py` would: its own `__main__`, its own frames in a traceback."""
    sys.argv = [start.path, *start.args]
    sys.orig_argv = [sys.executable, *sys.argv]
    # Not before: what the launcher loads is never one of a student's files.
    sys.path.insert(0, os.path.dirname(start.path))
    linecache.clearcache()
    importlib.invalidate_caches()
    sys.excepthook = _print_own_frames
    threading.excepthook = _print_own_frames_of_thread
    _leave_out_of_tracebacks()
    main = types.ModuleType("__main__")
    main.__file__ = start.path
    main.__builtins__ = builtins  # type: ignore[attr-defined]
    sys.modules["__main__"] = main
    with contextlib.suppress(Exception):
        attach.begin(_EVENTS, start.folder)
    for prefix in filter(None, os.environ.get("AMENT_PREFIX_PATH", "").split(":")):
        _use_package(prefix)
    with open(start.path, "rb") as file:
        source = file.read()
    exec(compile(source, start.path, "exec", dont_inherit=True), main.__dict__)


def _use_package(prefix: str) -> None:
    """Make an installed ROS package usable, as sourcing its workspace would have before the start.

    Its libraries are loaded at once: the loader reads its search path when a process begins, and this one is a fork.
    """
    version = f"python{sys.version_info.major}.{sys.version_info.minor}"
    sys.path.insert(1, os.path.join(prefix, "lib", version, "site-packages"))
    folder = os.path.join(prefix, "lib")
    libraries = sorted(name for name in os.listdir(folder) if name.endswith(".so")) if os.path.isdir(folder) else []
    waiting = [os.path.join(folder, name) for name in libraries]
    for _ in libraries:  # one needs another, so they are tried until no more of them loads
        waiting = [path for path in waiting if not _loads(path)]


def _loads(library: str) -> bool:
    try:
        ctypes.CDLL(library, mode=os.RTLD_NOW | os.RTLD_GLOBAL)
    except OSError:
        return False
    return True


def _print_own_frames(kind: type[BaseException], error: BaseException, trace: types.TracebackType | None) -> None:
    if isinstance(error, MemoryError):
        attach.note_memory_error()
    seen: set[int] = set()
    link: BaseException | None = error
    while link is not None and id(link) not in seen:
        seen.add(id(link))
        link.__traceback__ = _without_kit(link.__traceback__)
        link = link.__cause__ or link.__context__
    traceback.print_exception(kind, error, error.__traceback__)


def _print_own_frames_of_thread(args: threading.ExceptHookArgs) -> None:
    if args.exc_value is None or args.exc_type is SystemExit:
        return
    print(f"Exception in thread {args.thread.name if args.thread else '?'}:", file=sys.stderr)
    _print_own_frames(args.exc_type, args.exc_value, args.exc_traceback)


def _leave_out_of_tracebacks() -> None:
    """Whoever prints or logs a traceback, such as rclpy's action server: no frame of the probe is in it."""
    as_before = traceback.TracebackException.__init__

    def without_kit(self: Any, kind: Any, error: Any, trace: Any, *args: Any, **kwargs: Any) -> None:
        with contextlib.suppress(Exception):
            trace = _without_kit(trace)
        as_before(self, kind, error, trace, *args, **kwargs)

    traceback.TracebackException.__init__ = without_kit  # type: ignore[method-assign, assignment]


def _without_kit(trace: types.TracebackType | None) -> types.TracebackType | None:
    """The traceback without the frames of the launcher and the probe."""
    kept: list[types.TracebackType] = []
    while trace is not None:
        if not trace.tb_frame.f_code.co_filename.startswith(_OWN):
            kept.append(trace)
        trace = trace.tb_next
    result: types.TracebackType | None = None
    for entry in reversed(kept):
        result = types.TracebackType(result, entry.tb_frame, entry.tb_lasti, entry.tb_lineno)
    return result
