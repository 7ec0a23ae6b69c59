"""The command `autograder` without its imports: each one is a fork of a process that has loaded the kit and nbgrader.

Loading them takes most of the time of most commands. A fork has its own arguments, folder, environment and streams, and
ends as every Python does. How a command starts from nothing is seen in the tests that start the installed program.

As a script, this is the process that forks. It ends when the tests do.
"""

from __future__ import annotations

import functools
import gc
import json
import os
import socket
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any, BinaryIO

WITHIN = 600.0
"""Seconds: far beyond what a command takes on a busy machine."""


def run(folder: Path, *words: str | Path) -> subprocess.CompletedProcess[str]:
    """Run `autograder` with these words in a folder, in the environment of the tests as it is now."""
    asked = json.dumps({"folder": str(folder), "words": [*map(str, words)], "environment": dict(os.environ)})
    with tempfile.TemporaryFile() as out, tempfile.TemporaryFile() as err:
        channel = _server()
        socket.send_fds(channel, [asked.encode()], [out.fileno(), err.fileno()])
        status = int(channel.recv(100))
        return subprocess.CompletedProcess(words, status, _all_of(out), _all_of(err))


def _all_of(file: BinaryIO) -> str:
    file.seek(0)
    return file.read().decode()


@functools.cache
def _server() -> socket.socket:
    """Start the process that forks, once, and return what it listens to."""
    here, there = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    with there:
        subprocess.Popen([sys.executable, __file__, str(there.fileno())], pass_fds=[there.fileno()])
    here.settimeout(WITHIN)
    return here


def _serve(channel: socket.socket) -> dict[str, Any]:
    """Fork for each request, one after the other; return the request in the fork only."""
    while True:
        packet, streams, _, _ = socket.recv_fds(channel, 1 << 20, 2)
        if not packet:
            sys.exit()
        fork = os.fork()
        if fork == 0:
            channel.close()
            os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
            for number, stream in enumerate(streams, 1):
                os.dup2(stream, number)
                os.close(stream)
            asked: dict[str, Any] = json.loads(packet)
            return asked
        for stream in streams:
            os.close(stream)
        _, status = os.waitpid(fork, 0)
        channel.send(str(os.waitstatus_to_exitcode(status)).encode())


def _load() -> None:
    """Load what commands load."""
    from autograder.gradebook.own_courses import prepare_nbgrader

    prepare_nbgrader()
    import nbgrader.apps  # noqa: F401

    import autograder.cli.main
    import autograder.gradebook.class_run  # noqa: F401

    gc.freeze()  # a fork neither looks through what was loaded nor takes it apart in the end


if __name__ == "__main__":
    del sys.path[0]  # the folder of this file; the tests' modules are none of the command's
    _load()
    asked = _serve(socket.socket(fileno=int(sys.argv[1])))
    os.chdir(asked["folder"])
    os.environ.clear()
    os.environ.update(asked["environment"])
    sys.argv = ["autograder", *asked["words"]]
    from autograder.cli.main import main

    main()
