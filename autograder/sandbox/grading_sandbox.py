"""Runs a trusted module of this package in the grading sandbox, with input on stdin and output on stdout."""

from __future__ import annotations

import compileall
import contextlib
import functools
import os
import selectors
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass

from autograder.core import interrupts
from autograder.core.cpu_use import cpus_environment
from autograder.core.results import Isolation
from autograder.sandbox.environment import python_environment
from autograder.sandbox.forks import Fork, ForkServer
from autograder.sandbox.limits import MIB
from autograder.sandbox.walls import bubblewrap

OUTPUT_LIMIT = 64 * MIB
"""The bytes on stdout after which the run is ended."""
STDERR_KEPT = MIB
_STOP_POLL = 0.2
"""The seconds between two checks whether a run should be stopped."""

DROPPED_ID = 61771
"""The ID of the user and group to which root changes for grading. They own nothing."""

_GIVE_UP_ROOT = (
    f"import os,sys;n={DROPPED_ID};os.setgroups([]);os.setresgid(n,n,n);os.setresuid(n,n,n);"
    "os.execve(sys.argv[1],sys.argv[1:],{})"
)

_RUN_AND_END_WITH_PARENT = (
    "import ctypes,os,runpy,sys;ctypes.CDLL(None).prctl(1,9);"
    "os.getppid()==int(sys.argv[1]) or sys.exit('nobody waits for this');sys.argv=sys.argv[2:];"
    "runpy.run_module(sys.argv[0],run_name='__main__',alter_sys=True)"
)
"""A `python -m` that is killed when the thread that started it ends. It replaces bwrap's `--die-with-parent`."""


@dataclass
class SandboxRun:
    """The result of a run in the sandbox."""

    stdout: bytes
    stderr: str
    status: int
    """The exit status. A negative number is that of the signal that ended the run."""
    timed_out: bool


class Stopped(Exception):
    """A run was ended because its result is no longer needed."""


def run_in_sandbox(
    module_args: list[str],
    stdin: bytes,
    isolation: Isolation,
    time_limit: float,
    stop: threading.Event | None = None,
    heard: Callable[[bytes], None] | None = None,
) -> SandboxRun:
    """Run `python -m <module_args…>` in the grading sandbox and wait for it.

    The module sees this virtual environment, the `autograder` package and an empty /tmp, but no labs, no submissions,
    no gradebook and no network. With reduced or no isolation, it is an ordinary child process.

    Args:
        module_args: the name of the module and its arguments.
        stdin: the module's input.
        isolation: the isolation, as returned by `isolation.choose`.
        time_limit: the seconds after which everything in the sandbox is ended.
        stop: everything in the sandbox is ended soon after this event is set.
        heard: called with each piece of the module's output on stdout as it arrives.

    Raises:
        OSError: the sandbox cannot be started at all.
        Stopped: `stop` was set.
    """
    if stop is not None and stop.is_set():
        raise Stopped
    _compile_package()
    if isolation is not Isolation.FULL:
        return _run(_start_child(module_args), stdin, time_limit, stop, heard)
    fork = _forks.fork(module_args)
    run = _run(fork, stdin, time_limit, stop, heard)
    if fork.lost and not fork.begun:  # the server was killed before it received the request
        _forks.gone()
        fork = _forks.fork(module_args)
        run = _run(fork, stdin, time_limit, stop, heard)
    if fork.lost:
        run.stderr += _forks.gone()
    return run


def _run(
    process: subprocess.Popen[bytes] | Fork,
    stdin: bytes,
    time_limit: float,
    stop: threading.Event | None,
    heard: Callable[[bytes], None] | None,
) -> SandboxRun:
    try:
        return exchange(process, stdin, time_limit, stop, heard)
    finally:
        with contextlib.suppress(ProcessLookupError):
            process.kill()
        process.wait()
        for stream in (process.stdin, process.stdout, process.stderr):
            if stream is not None:
                with contextlib.suppress(OSError):
                    stream.close()


def _environment() -> dict[str, str]:
    return {
        **python_environment(),
        **cpus_environment(),
        "PYTHONPATH": str(bubblewrap.PACKAGE.parent),
        "PYTHONSAFEPATH": "1",
        "HOME": "/tmp",
    }


def _start_child(module_args: list[str]) -> subprocess.Popen[bytes]:
    """Start a child process for a run without full isolation; it ends with the calling thread."""
    command = [sys.executable, "-c", _RUN_AND_END_WITH_PARENT, str(os.getpid()), *module_args]
    pipe = subprocess.PIPE
    return subprocess.Popen(
        command, env=_environment(), start_new_session=True, stdin=pipe, stdout=pipe, stderr=pipe, cwd="/"
    )


def start_fork_server(channel: int, stderr: int, idle: float = 60.0) -> subprocess.Popen[bytes]:
    """Start the server that forks the processes of the grading sandbox.

    The server itself runs in a sandbox, and ends with the calling thread.

    Args:
        channel: the server's end of the socket pair on which it receives requests.
        stderr: the descriptor for its standard error.
        idle: the seconds without a request or a running fork after which it ends to free its memory.
    """
    command = [sys.executable, "-m", "autograder.sandbox.fork_server", str(channel), str(idle)]
    around = None
    if os.getuid() == 0:
        # Namespaces can be nested only by an ordinary user, but only root may read below /root. Therefore root is given
        # up inside a private mount tree, in which this Python is below folders that everyone may enter.
        around = (bubblewrap.options_for_root(), [sys.executable, "-I", "-S", "-c", _GIVE_UP_ROOT])
    copies = bubblewrap.copies_of_files()
    options = bubblewrap.outer_options(_environment(), copies)
    try:
        return bubblewrap.start_bwrap(options, command, (channel, *copies.values()), stderr=stderr, around=around)
    finally:
        for descriptor in copies.values():
            os.close(descriptor)


_forks = ForkServer(start_fork_server)
"""The fork server of this process. It starts with the first run with full isolation."""


def _compile_package() -> None:
    with _compiling:  # when a class is graded, many threads call this at once
        _compile_package_once()


_compiling = threading.Lock()


@functools.cache
def _compile_package_once() -> None:
    """Update the package's bytecode, because a sandbox cannot write it and would compile everything each time."""
    compileall.compile_dir(bubblewrap.PACKAGE, quiet=2)  # if it may not write here either, it is ignored


def exchange(
    process: subprocess.Popen[bytes] | Fork,
    stdin: bytes,
    time_limit: float,
    stop: threading.Event | None = None,
    heard: Callable[[bytes], None] | None = None,
) -> SandboxRun:
    """Send a process its input and collect its output, until it ends, writes too much, or its time is over.

    Args:
        process: the process, with pipes for its three streams. The caller ends it if an exception is raised.
        stdin: the process's input.
        time_limit: the limit in seconds.
        stop: the exchange is given up soon after this event is set.
        heard: called with each piece of the output on stdout as it arrives.

    Raises:
        Stopped: by `stop`.
    """
    assert process.stdin is not None and process.stdout is not None and process.stderr is not None
    deadline = time.monotonic() + time_limit
    taken: dict[str, bytearray] = {"stdout": bytearray(), "stderr": bytearray()}
    waiting = memoryview(stdin)
    timed_out = False
    with selectors.DefaultSelector() as selector:
        for stream, name in ((process.stdin, "stdin"), (process.stdout, "stdout"), (process.stderr, "stderr")):
            os.set_blocking(stream.fileno(), False)
            selector.register(
                stream, selectors.EVENT_WRITE if name == "stdin" else selectors.EVENT_READ, (name, stream)
            )
        while any(key.data[0] != "stdin" for key in selector.get_map().values()):
            left = deadline - time.monotonic()
            if left <= 0 or len(taken["stdout"]) > OUTPUT_LIMIT:
                timed_out = left <= 0
                process.kill()
                break
            if stop is not None and stop.is_set():
                raise Stopped
            interrupts.here()
            for key, _ in selector.select(min(left, _STOP_POLL)):
                name, stream = key.data
                if name == "stdin":
                    waiting = _fed(stream.fileno(), waiting)
                    if not waiting:
                        selector.unregister(stream)
                        stream.close()
                    continue
                data = os.read(stream.fileno(), 1 << 18)
                if not data:
                    selector.unregister(stream)
                elif name == "stdout" or len(taken["stderr"]) < STDERR_KEPT:
                    taken[name] += data
                    if name == "stdout" and heard is not None:
                        heard(data)
    try:
        status = process.wait(max(0.5, deadline - time.monotonic()))
    except subprocess.TimeoutExpired:
        process.kill()
        status, timed_out = process.wait(), True
    return SandboxRun(bytes(taken["stdout"]), taken["stderr"].decode("utf-8", "replace"), status, timed_out)


def _fed(pipe: int, waiting: memoryview) -> memoryview:
    """Write as much as the pipe takes, and return the rest. If nobody reads the pipe any more, nothing is left."""
    try:
        return waiting[os.write(pipe, waiting[: 1 << 16]) :]
    except BrokenPipeError:
        return waiting[:0]
