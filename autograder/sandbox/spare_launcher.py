"""Launchers that have loaded ROS before a submission comes; `inside/warm_launchers.py` describes their server.

The fork server starts that server. Each of its forks, before it reads anything, asks for a spare launcher, and the
worker in the fork lets the spare into its node sandbox. Without a spare, a node sandbox starts a launcher of its own.
"""

from __future__ import annotations

import contextlib
import json
import os
import socket
import subprocess
import sys
from collections.abc import Sequence

from autograder.sandbox.walls import bubblewrap

_OWN_SETTINGS = ("PYTHONPATH", "PYTHONSAFEPATH", "HOME", "AUTOGRADER_CPUS")
"""The variables of the fork server that programs must not see."""
_HOLD = ["/bin/sh", "-c", "echo; read -r _"]
"""The first process of a node sandbox: it says that the sandbox is complete, and ends when its input is closed."""

_spare: socket.socket | None = None
"""The socket to this submission's spare launcher."""


def start_server() -> socket.socket:
    """Start the server of launchers, and return the socket to it. When the socket is closed, the server ends."""
    ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    command = [sys.executable, "-I", f"{bubblewrap.KIT_FOLDER}/launcher.py", "--warm", str(theirs.fileno())]
    with theirs:
        subprocess.Popen(
            command, env={name: value for name, value in os.environ.items() if name not in _OWN_SETTINGS},
            stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, pass_fds=(theirs.fileno(),), cwd="/",
        )  # fmt: skip
    return ours


def ask(server: socket.socket) -> None:
    """Ask for a spare launcher in the namespaces of this process, for this process and its forks."""
    global _spare
    ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    handle = os.pidfd_open(os.getpid())
    with theirs, server, contextlib.suppress(OSError):  # if the server has ended, there is no spare
        socket.send_fds(server, [b"spare"], [handle, theirs.fileno()])
        _spare = ours
    os.close(handle)


def start_launcher(options: Sequence[str], channel: int, stderr: int) -> subprocess.Popen[bytes] | None:
    """Make a node sandbox with the spare launcher in it, and return its process; None if there is no spare.

    Args:
        options: bubblewrap's options for the sandbox.
        channel: the launcher's end of its socket.
        stderr: the file for its standard error.

    Raises:
        OSError: the sandbox cannot be made, or the spare has ended.
    """
    if _spare is None:
        return None
    info, theirs = os.pipe()
    try:
        process = bubblewrap.start_bwrap(
            ["--info-fd", str(theirs), *options], _HOLD, (theirs,),
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=stderr,
        )  # fmt: skip
        os.close(theirs)
        theirs = -1
        try:
            _let_in(_spare, process, info, channel, stderr)
        except BaseException:
            process.kill()
            process.wait()
            raise
        return process
    finally:
        os.close(info)
        if theirs >= 0:
            os.close(theirs)


def _let_in(spare: socket.socket, process: subprocess.Popen[bytes], info: int, channel: int, stderr: int) -> None:
    assert process.stdout is not None
    with process.stdout as said:
        if not said.read(1):
            raise OSError("the node sandbox is not complete")
    try:
        first = int(json.loads(os.read(info, 1000))["child-pid"])
    except (ValueError, KeyError) as error:
        raise OSError("bubblewrap does not tell its first process") from error
    handle = os.pidfd_open(first)
    try:
        socket.send_fds(spare, [b"launcher"], [handle, channel, stderr])
    finally:
        os.close(handle)
