"""Starts a student's programs by forking itself, with Python, rclpy and the usual messages already loaded.

There are three kinds of processes, each of which is a fork of the one before:

- the launcher, which loads everything once and runs none of the student's code;
- for each launch a *first process*, which has its own process list, /tmp and /dev/shm if the kernel allows it
  (`"namespaces"`), no privileges, and the limits of a launch. When it has ended, all its programs have ended;
- the programs. They cannot see the launcher, and cannot read, write, stop or end the first process. They cannot read or
  write each other's memory either.

Usage: launcher.py FD [SCRATCH], or launcher.py --warm FD. FD is one end of a SOCK_SEQPACKET pair; `requests.py`
describes the messages on it. The launcher and each first process end, with all their descendants, when their socket is
closed. The launcher then removes the folder SCRATCH, unless the process that started it is still alive. With `--warm`,
this is the server that `warm_launchers.py` describes.
"""

import importlib
import importlib.util
import os
import socket
import sys
from typing import Any

_NAME = "_autograder_inside"


def _parts(*names: str) -> list[Any]:
    """Load the folder of this file as a package, wherever it is, and return modules of it."""
    folder = os.path.dirname(os.path.abspath(__file__))
    spec = importlib.util.spec_from_file_location(
        _NAME, os.path.join(folder, "__init__.py"), submodule_search_locations=[folder]
    )
    assert spec is not None and spec.loader is not None
    package = importlib.util.module_from_spec(spec)
    sys.modules[_NAME] = package
    spec.loader.exec_module(package)
    return [importlib.import_module(f"{_NAME}.{name}") for name in names]


if __name__ == "__main__":
    launches, program, warm_launchers, warm_up = _parts("launches", "program", "warm_launchers", "warm_up")
    warm_up.warm_up()
    if sys.argv[1] == "--warm":
        launch = launches.serve_launches(warm_launchers.serve_submissions(socket.socket(fileno=int(sys.argv[2]))), "")
    else:
        launch = launches.serve_launches(socket.socket(fileno=int(sys.argv[1])), "".join(sys.argv[2:]))
    start = launches.serve_programs(launch)
    program.become(start)
    program.run(start)
