"""Starts a student's programs by forking itself, with Python, rclpy and the usual messages already loaded.

Three kinds of process come of this file, each a fork of the one before:

- the launcher, which loads everything once and starts nothing of a student's;
- for each launch a *first process*, with a process list, a /tmp and a /dev/shm of its own where the kernel gives them
  (`"namespaces"`), without privileges, and with the limits of a launch. When it ends, all its programs have ended;
- the programs. They can neither see the launcher nor read, write, stop or end the first process, nor read or write
  each other's memory.

Usage: launcher.py FD [SCRATCH]. FD is one end of a SOCK_SEQPACKET pair; what is said on it stands in `requests.py`.
At the end of its socket each of these processes ends, and takes what is below it along. The launcher removes the
folder SCRATCH, unless the process that started it still lives.
"""

import importlib
import importlib.util
import os
import socket
import sys
from typing import Any

_NAME = "_autograder_inside"


def _parts(*names: str) -> list[Any]:
    """Load the folder of this file as a package, wherever it lies, and return modules of it."""
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
    launches, program, warm_up = _parts("launches", "program", "warm_up")
    warm_up.warm_up()
    launch = launches.serve_launches(socket.socket(fileno=int(sys.argv[1])), "".join(sys.argv[2:]))
    start = launches.serve_programs(launch)
    program.become(start)
    program.run(start)
