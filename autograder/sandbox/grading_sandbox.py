"""Runs a trusted module of this package in the grading sandbox: one process tree, input by stdin, output by stdout."""

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
"""Bytes of stdout after which the run is ended."""
STDERR_KEPT = MIB
_STOP_POLL = 0.2
"""Seconds between two looks at whether a run is to be stopped."""

DROPPED_ID = 61771
"""The user and group that root becomes for grading: one that owns nothing."""

_GIVE_UP_ROOT = (
    f"import os,sys;n={DROPPED_ID};os.setgroups([]);os.setresgid(n,n,n);os.setresuid(n,n,n);"
    "os.execve(sys.argv[1],sys.argv[1:],{})"
)

_RUN_AND_END_WITH_PARENT = (
    "import ctypes,os,runpy,sys;ctypes.CDLL(None).prctl(1,9);"
    "os.getppid()==int(sys.argv[1]) or sys.exit('nobody waits for this');sys.argv=sys.argv[2:];"
    "runpy.run_module(sys.argv[0],run_name='__main__',alter_sys=True)"
)
"""Without bwrap's `--die-with-parent`: `python -m` that is killed with the thread that started it."""


@dataclass
class SandboxRun:
    """What came out of a run in the sandbox."""

    stdout: bytes
    stderr: str
    status: int
    """Exit status; negative: the number of the signal that ended it."""
    timed_out: bool


class Stopped(Exception):
    """A run was ended because nobody wants its result any more."""


def run_in_sandbox(
    module_args: list[str],
    stdin: bytes,
    isolation: Isolation,
    time_limit: float,
    stop: threading.Event | None = None,
    heard: Callable[[bytes], None] | None = None,
) -> SandboxRun:
    """Run `python -m <module_args…>` in the grading sandbox and wait for it.

    The module sees this virtual environment, the `autograder` package and an empty /tmp; no labs, no submissions, no
    gradebook, no network. With reduced or no isolation it is a plain child process.

    Args:
        module_args: module name and its arguments.
        stdin: what it reads.
        isolation: as `isolation.choose` returned it.
        time_limit: seconds after which everything in the sandbox is ended.
        stop: everything in it is ended soon after this is set.
        heard: is given what it writes on stdout, as it comes.

    Raises:
        OSError: the sandbox cannot be started at all.
        Stopped: by `stop`.
    """
    if stop is not None and stop.is_set():
        raise Stopped
    _compile_package()
    if isolation is not Isolation.FULL:
        return _run(_start_child(module_args), stdin, time_limit, stop, heard)
    fork = _forks.fork(module_args)
    run = _run(fork, stdin, time_limit, stop, heard)
    if fork.lost and not fork.begun:  # the server was killed before it heard of it
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
    """Without full isolation: a child that ends with the thread that calls this."""
    command = [sys.executable, "-c", _RUN_AND_END_WITH_PARENT, str(os.getpid()), *module_args]
    pipe = subprocess.PIPE
    return subprocess.Popen(
        command, env=_environment(), start_new_session=True, stdin=pipe, stdout=pipe, stderr=pipe, cwd="/"
    )


def start_fork_server(channel: int, stderr: int, idle: float = 60.0) -> subprocess.Popen[bytes]:
    """Start what forks the processes of the grading sandbox; it is in one itself, and ends with the calling thread.

    Args:
        channel: its end of the socket pair on which it is asked for forks.
        stderr: where its standard error goes.
        idle: seconds without a request or a fork after which it ends, to give the memory back.
    """
    command = [sys.executable, "-m", "autograder.sandbox.fork_server", str(channel), str(idle)]
    around = None
    if os.getuid() == 0:
        # Namespaces nest only for an ordinary user, and only root may read below /root: give up root inside a mount
        # tree of our own, in which this Python lies under folders that everyone may enter.
        around = (bubblewrap.options_for_root(), [sys.executable, "-I", "-S", "-c", _GIVE_UP_ROOT])
    copies = bubblewrap.copies_of_files()
    options = bubblewrap.outer_options(_environment(), copies)
    try:
        return bubblewrap.start_bwrap(options, command, (channel, *copies.values()), stderr=stderr, around=around)
    finally:
        for descriptor in copies.values():
            os.close(descriptor)


_forks = ForkServer(start_fork_server)
"""Of this process; it starts with the first run in full isolation."""


def _compile_package() -> None:
    with _compiling:  # the threads of a class come here all at once
        _compile_package_once()


_compiling = threading.Lock()


@functools.cache
def _compile_package_once() -> None:
    """Keep the package's bytecode up to date: a sandbox cannot write it, and would compile everything each time."""
    compileall.compile_dir(bubblewrap.PACKAGE, quiet=2)  # where it may not write either, it goes on


def exchange(
    process: subprocess.Popen[bytes] | Fork,
    stdin: bytes,
    time_limit: float,
    stop: threading.Event | None = None,
    heard: Callable[[bytes], None] | None = None,
) -> SandboxRun:
    """Feed a process and take what it writes, until it ends, writes too much, or its time is over.

    Args:
        process: with pipes for its three streams; whoever started it ends it.
        stdin: what it reads.
        time_limit: seconds.
        stop: gives up soon after this is set.
        heard: is given what it writes on stdout, as it comes.

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
    """Write as much as a pipe takes, and return the rest: nothing if nobody reads it any more."""
    try:
        return waiting[os.write(pipe, waiting[: 1 << 16]) :]
    except BrokenPipeError:
        return waiting[:0]
