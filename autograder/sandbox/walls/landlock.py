"""Reduced isolation: if there are no user namespaces, the kernel's Landlock restricts access to files and signals.

It hides neither the network nor the process list. Run as a module, it confines itself and becomes another program:
`python -m autograder.sandbox.walls.landlock READ_ONLY… -- WRITABLE… -- COMMAND…`.
"""

from __future__ import annotations

import ctypes
import os
import struct
import sys
from collections.abc import Sequence
from pathlib import Path

from autograder.sandbox.environment import HERE, INSIDE, SYSTEM_FILES, SYSTEM_FOLDERS, python_places
from autograder.sandbox.inside.kernel import filter_calls
from autograder.sandbox.walls import seccomp

NEEDED_VERSION = 6
"""The first version that also restricts signals and abstract sockets."""

_CREATE_RULESET, _ADD_RULE, _RESTRICT_SELF = 444, 445, 446
_EXECUTE, _WRITE_FILE, _READ_FILE, _READ_DIR = 1 << 0, 1 << 1, 1 << 2, 1 << 3
_ALL_FILES = (1 << 16) - 1  # all kinds of file-system access in version 5 and later
_FILE_ONLY = _EXECUTE | _WRITE_FILE | _READ_FILE | 1 << 14 | 1 << 15
_READ = _EXECUTE | _READ_FILE | _READ_DIR
_SET_SECUREBITS, _ROOT_IS_NOTHING = 28, 0x2F
_SCOPED = 1 << 0 | 1 << 1  # abstract sockets, signals
_DEVICES = ("/dev/null", "/dev/zero", "/dev/full", "/dev/random", "/dev/urandom")

_libc = ctypes.CDLL(None, use_errno=True)


def version() -> int:
    """Return the kernel's version of Landlock, or 0 if it has none."""
    return max(0, int(_libc.syscall(_CREATE_RULESET, None, ctypes.c_size_t(0), 1)))


def confined(command: Sequence[str], folder: Path, scratch: Path) -> list[str]:
    """Return a command that runs `command` with access to Python, ROS and `folder`, and writing only to `scratch`."""
    readable = [*SYSTEM_FOLDERS, *SYSTEM_FILES, *map(str, python_places().paths), str(folder), "/proc", str(INSIDE)]
    return [
        sys.executable, "-I", "-c", f"import sys; sys.path.append({str(HERE.parent.parent)!r}); "
        "from autograder.sandbox.walls.landlock import main; main()",
        *readable, "--", str(scratch), *_DEVICES, "--", *command,
    ]  # fmt: skip


def confine(readable: Sequence[str], writable: Sequence[str]) -> None:
    """Confine this process, and everything that it starts, with Landlock and the filter of system calls.

    Raises:
        OSError: the kernel refuses.
    """
    handled = struct.pack("QQQ", _ALL_FILES, 0, _SCOPED)
    ruleset = _checked(_libc.syscall(_CREATE_RULESET, handled, ctypes.c_size_t(len(handled)), 0))
    for paths, access in ((readable, _READ), (writable, _ALL_FILES)):
        for path in paths:
            if not Path(path).exists():
                continue
            allowed = access if Path(path).is_dir() else access & _FILE_ONLY
            descriptor = os.open(path, os.O_PATH | os.O_CLOEXEC)
            rule = struct.pack("=Qi", allowed, descriptor)
            _checked(_libc.syscall(_ADD_RULE, ruleset, 1, rule, 0))
            os.close(descriptor)
    if os.geteuid() == 0:
        # Root must keep no capability after the following exec, because some of them bypass Landlock.
        _checked(_libc.prctl(_SET_SECUREBITS, _ROOT_IS_NOTHING, 0, 0, 0))
    _checked(_libc.prctl(38, 1, 0, 0, 0))
    _checked(_libc.syscall(_RESTRICT_SELF, ruleset, 0))
    os.close(ruleset)
    filter_calls(seccomp.filter_program())


def _checked(result: int) -> int:
    if result < 0:
        raise OSError(ctypes.get_errno(), os.strerror(ctypes.get_errno()))
    return result


def main() -> None:
    """Confine this process, and run the command in it."""
    readable, rest = _split(sys.argv[1:])
    writable, command = _split(rest)
    confine(readable, writable)
    os.execve(command[0], command, dict(os.environ))


def _split(words: list[str]) -> tuple[list[str], list[str]]:
    place = words.index("--")
    return words[:place], words[place + 1 :]
