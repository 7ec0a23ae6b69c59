"""Turns a forked process into one like that of `python NAME.py`, and runs the file."""

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
"""The seconds to wait for rclpy's thread, which normally takes milliseconds."""


def interrupt(number: int, frame: FrameType | None) -> None:
    """Raise KeyboardInterrupt, as Python does, after rclpy has handled this signal.

    At SIGINT, a thread of rclpy shuts the context down, while Python raises KeyboardInterrupt in the main thread. The
    order of the two is not defined. So `rclpy.shutdown()` after the exception usually fails, but sometimes does not,
    and even `rclpy.try_shutdown()` occasionally fails, because the context can be shut down between its check and its
    call. With this handler, rclpy's shutdown always comes first.
    """
    with contextlib.suppress(Exception):
        deadline = time.monotonic() + _SHUT_DOWN_WITHIN
        while _about_to_shut_down() and time.monotonic() < deadline:
            time.sleep(0.002)
    signal.default_int_handler(number, frame)


def _about_to_shut_down() -> bool:
    """Whether rclpy handles the signal, and its default context is not shut down yet.

    This takes no lock, because the main thread, which it interrupts, may hold any of them.
    """
    signals, utilities = sys.modules.get("rclpy.signals"), sys.modules.get("rclpy.utilities")
    context = getattr(utilities, "g_default_context", None)
    if signals is None or context is None or context.handle is None:
        return False
    handled = signals.get_current_signal_handlers_options()
    options = signals.SignalHandlerOptions
    return handled in (options.ALL, options.SIGINT) and bool(context.handle.ok())


_EVENTS, _STACKS = 3, 4
"""The descriptors for the output of the probe and for the stacks."""

_OWN = os.path.dirname(os.path.abspath(__file__)) + os.sep


def become(start: Start) -> None:
    """Set up this forked process as a program expects it: its descriptors, limits and environment."""
    os.setsid()
    if not start.hidden:
        prctl(PR_SET_DUMPABLE, 1)
    _take_descriptors(start)
    with contextlib.suppress(OSError):
        os.sched_setaffinity(0, start.cpus)
    if len(start.cpus) < start.cores:  # rclpy uses this number of threads, which must be the same on every machine
        pretended = set(range(start.cores))
        os.sched_getaffinity = lambda _pid: pretended
    os.cpu_count = lambda: start.cores  # otherwise it counts all CPUs of the machine, even those not usable here
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
    """Move the program's descriptors to the numbers that it expects, and close all others."""
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
    """Run the program as `python NAME.py` does, with its own `__main__`, and only its own frames in a traceback."""
    sys.argv = [start.path, *start.args]
    sys.orig_argv = [sys.executable, *sys.argv]
    # This is done only now, so that the launcher never loads one of the student's files.
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
        attach.begin(_EVENTS, start.folder, start.assume_success)
    for prefix in filter(None, os.environ.get("AMENT_PREFIX_PATH", "").split(":")):
        _use_package(prefix)
    with open(start.path, "rb") as file:
        source = file.read()
    exec(compile(source, start.path, "exec", dont_inherit=True), main.__dict__)


def _use_package(prefix: str) -> None:
    """Make an installed ROS package usable, as if its workspace had been sourced before the start.

    The package's libraries are loaded immediately, because the dynamic loader reads its search path only when a process
    starts, and this process is a fork.
    """
    version = f"python{sys.version_info.major}.{sys.version_info.minor}"
    sys.path.insert(1, os.path.join(prefix, "lib", version, "site-packages"))
    folder = os.path.join(prefix, "lib")
    libraries = sorted(name for name in os.listdir(folder) if name.endswith(".so")) if os.path.isdir(folder) else []
    waiting = [os.path.join(folder, name) for name in libraries]
    for _ in libraries:  # libraries depend on each other, so the remaining ones are tried again
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
    """Remove the kit's frames from all tracebacks that are printed or logged, for example by rclpy's action server."""
    as_before = traceback.TracebackException.__init__

    def without_kit(self: Any, kind: Any, error: Any, trace: Any, *args: Any, **kwargs: Any) -> None:
        with contextlib.suppress(Exception):
            trace = _without_kit(trace)
        as_before(self, kind, error, trace, *args, **kwargs)

    traceback.TracebackException.__init__ = without_kit  # type: ignore[method-assign, assignment]


def _without_kit(trace: types.TracebackType | None) -> types.TracebackType | None:
    """Return the traceback without the frames of the launcher and the probe."""
    kept: list[types.TracebackType] = []
    while trace is not None:
        if not trace.tb_frame.f_code.co_filename.startswith(_OWN):
            kept.append(trace)
        trace = trace.tb_next
    result: types.TracebackType | None = None
    for entry in reversed(kept):
        result = types.TracebackType(result, entry.tb_frame, entry.tb_lasti, entry.tb_lineno)
    return result
