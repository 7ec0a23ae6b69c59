"""What attacks share: `tries` reports what should have been refused and was not. No attack itself."""

import ctypes
import os

libc = ctypes.CDLL(None, use_errno=True)


def tries(what, act):
    """Do it; whatever comes back but an error, or a call's -1, is an escape."""
    try:
        result = act()
    except (OSError, ValueError, AttributeError):
        return
    if result != -1:
        print("ESCAPED", what, str(result)[:200], flush=True)


def call(number, *arguments):
    """Ask the kernel itself; -1 if it refuses."""
    return libc.syscall(number, *arguments)


def others():
    """Process ids of everyone else that can be seen."""
    return [int(name) for name in os.listdir("/proc") if name.isdigit() and int(name) != os.getpid()]


def write(path, data=b"0\n"):
    """Write to a file that must not be writable."""
    descriptor = os.open(path, os.O_WRONLY)
    try:
        return os.write(descriptor, data)
    finally:
        os.close(descriptor)


def read(path):
    """Read a file that must not be readable."""
    with open(path, "rb", buffering=0) as file:
        return file.read(64)
