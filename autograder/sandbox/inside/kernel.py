"""The system calls for which Python has no functions, and the numbers for their arguments."""

import contextlib
import ctypes
import os
import resource
import struct

CLONE_NEWNS, CLONE_NEWPID = 0x20000, 0x20000000
CLONE_NEWUTS, CLONE_NEWIPC, CLONE_NEWUSER, CLONE_NEWNET = 0x4000000, 0x8000000, 0x10000000, 0x40000000
MS_RDONLY, MS_NOSUID, MS_NODEV, MS_NOEXEC = 1, 2, 4, 8
MS_REMOUNT, MS_BIND, MS_REC, MS_PRIVATE = 0x20, 0x1000, 0x4000, 1 << 18
PR_SET_PDEATHSIG, PR_SET_DUMPABLE, PR_SET_NAME, PR_SET_CHILD_SUBREAPER = 1, 4, 15, 36
_PR_SET_SECCOMP, _PR_SET_NO_NEW_PRIVS = 22, 38
_PR_CAPBSET_DROP, _PR_CAP_AMBIENT, _PR_CAP_AMBIENT_CLEAR_ALL = 24, 47, 4
CAP_SETPCAP, CAP_SYS_ADMIN = 8, 21

libc = ctypes.CDLL(None, use_errno=True)
prctl = libc.prctl


def checked(result: int) -> None:
    """Raise the error that a call has left in errno, unless the call returned 0.

    Raises:
        OSError: the call did not return 0.
    """
    if result != 0:
        raise OSError(ctypes.get_errno(), os.strerror(ctypes.get_errno()))


class _FilterProgram(ctypes.Structure):
    _fields_ = (("length", ctypes.c_ushort), ("filter", ctypes.c_char_p))


def filter_calls(content: bytes) -> None:
    """Apply a filter of system calls, which is an array of `struct sock_filter`, to this process.

    Raises:
        OSError: the kernel refuses.
    """
    program = _FilterProgram(len(content) // 8, content)
    prctl(_PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0)
    if prctl(_PR_SET_SECCOMP, 2, ctypes.byref(program), 0, 0) != 0:
        raise OSError("the filter of system calls was refused")


def give_up_privileges(*kept: int) -> None:
    """Give up capabilities, in this process and in all that it starts later, and check that none of them is left.

    Args:
        kept: the numbers of the capabilities that are not given up.

    Raises:
        OSError: a capability is left.
    """
    number, wanted = 0, sum(1 << one for one in kept)
    while number in kept or prctl(_PR_CAPBSET_DROP, number, 0, 0, 0) == 0:
        number += 1  # the call fails after the last capability that the kernel knows
    checked(prctl(_PR_CAP_AMBIENT, _PR_CAP_AMBIENT_CLEAR_ALL, 0, 0, 0))
    header = struct.pack("II", 0x20080522, 0)  # capset(2), version 3
    checked(libc.capset(header, struct.pack("6I", wanted, wanted, 0, 0, 0, 0)))
    checked(prctl(_PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0))
    with open("/proc/self/status") as status:
        left = [line for line in status if line.startswith("Cap") and int(line.split()[1], 16) & ~wanted]
    if left:
        raise OSError(f"privileges are left: {' '.join(left)}")


def limit(name: str, value: int) -> None:
    """Set a limit of this process by its name in the `resource` module. A limit that is already lower is kept."""
    which = getattr(resource, name)
    _, hard = resource.getrlimit(which)
    if hard != resource.RLIM_INFINITY:
        value = min(value, hard)
    with contextlib.suppress(ValueError, OSError):
        resource.setrlimit(which, (value, value))
