"""Processes of the grading sandbox that a server forks, so that no sandbox must be started anew for each of them."""

from __future__ import annotations

import contextlib
import json
import os
import select
import socket
import subprocess
import threading
import time
from collections.abc import Callable

ServerStart = Callable[[int, int], "subprocess.Popen[bytes]"]
"""The type of a function that starts the server, given its end of the channel and a descriptor for its stderr."""

BEGUN = b"begun"
"""The first message on a lifeline; the exit status is the second."""
KILLED = -9
"""The exit status of a fork if it is not known how it ended."""


class Fork:
    """A forked process that can be used like one that `subprocess.Popen` started with three pipes."""

    def __init__(self, life_line: socket.socket, stdin: int, stdout: int, stderr: int) -> None:
        """Keep the lifeline and open the pipes; `ForkServer.fork` creates the object."""
        self._life_line = life_line
        self._status: int | None = None
        self.begun = False
        """Whether the process has begun; this is known only after `wait`."""
        self.lost = False
        """Whether it is not known how it ended, as for all forks after their server was killed."""
        self.stdin = os.fdopen(stdin, "wb", 0)
        self.stdout, self.stderr = os.fdopen(stdout, "rb", 0), os.fdopen(stderr, "rb", 0)

    def kill(self) -> None:
        """End the process and everything that it started."""
        with contextlib.suppress(OSError):
            self._life_line.shutdown(socket.SHUT_WR)

    def wait(self, timeout: float | None = None) -> int:
        """Wait until the process and everything that it started has ended, and return its exit status.

        Raises:
            subprocess.TimeoutExpired: it has not ended after `timeout` seconds.
        """
        if self._status is not None:
            return self._status
        poll = select.poll()
        poll.register(self._life_line, select.POLLIN)
        deadline = None if timeout is None else time.monotonic() + timeout
        said = BEGUN
        while said == BEGUN:
            if not poll.poll(None if deadline is None else 1000 * max(0.0, deadline - time.monotonic())):
                raise subprocess.TimeoutExpired("fork", timeout or 0.0)
            said = b""
            with contextlib.suppress(OSError):
                said = self._life_line.recv(100)
            self.begun = self.begun or said == BEGUN
        self.lost = not said
        self._status = int(said or KILLED)
        self._life_line.close()
        return self._status


class ForkServer:
    """The fork server of this process. It ends with this process, or after some time without work.

    If it has ended, the next request starts a new one.

    Args:
        start: the function that starts it.
    """

    def __init__(self, start: ServerStart) -> None:
        """Begin without a server; it is started when it is needed."""
        self._start = start
        self._lock = threading.Lock()
        self._channel: socket.socket | None = None
        self._said = -1

    def fork(self, module_args: list[str]) -> Fork:
        """Let the server fork a process that runs `python -m <module_args…>`.

        Raises:
            OSError: the server cannot be started.
        """
        with self._lock:
            if self._channel is not None:
                fork, heard = _ask(self._channel, module_args)
                if heard:
                    return fork
                self._close()
            self._channel = self._begin()
            return _ask(self._channel, module_args)[0]  # if this server has ended at once, the fork counts as ended

    def gone(self) -> str:
        """Give up a server that has lost a fork, and return what it has written to its standard error."""
        with self._lock:
            said = os.pread(self._said, 10_000, 0).decode("utf-8", "replace") if self._said >= 0 else ""
            self._close()
            return said

    def _close(self) -> None:
        if self._channel is not None:
            self._channel.close()
            os.close(self._said)
        self._channel, self._said = None, -1

    def _begin(self) -> socket.socket:
        """Start the server, and return the channel to it.

        It is started by a thread that continues to run, because a bubblewrap sandbox ends with the thread that started
        it.
        """
        channel, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        self._said = os.memfd_create("fork server")
        tried = threading.Event()
        problems: list[BaseException] = []

        def keep() -> None:
            try:
                process = self._start(theirs.fileno(), self._said)
            except BaseException as problem:
                problems.append(problem)
                return
            finally:
                theirs.close()
                tried.set()
            process.wait()

        threading.Thread(target=keep, name="fork server", daemon=True).start()
        tried.wait()
        if problems:
            channel.close()
            os.close(self._said)
            raise problems[0]
        return channel


def _ask(channel: socket.socket, module_args: list[str]) -> tuple[Fork, bool]:
    """Request a fork, and return it and whether the server has received the request."""
    ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    (their_in, our_in), (our_out, their_out), (our_err, their_err) = os.pipe(), os.pipe(), os.pipe()
    fork = Fork(ours, our_in, our_out, our_err)
    passed = [theirs.fileno(), their_in, their_out, their_err]
    try:
        socket.send_fds(channel, [json.dumps(module_args).encode()], passed)
    except OSError:
        return fork, False
    finally:
        theirs.close()
        for descriptor in passed[1:]:
            os.close(descriptor)
    return fork, True
