"""The system calls that are refused to a student's program, as a filter for the kernel.

The filter lists what is denied, not what is allowed, because Python and DDS use most of the other calls, and programs
are isolated mainly by namespaces, capabilities and limits. It denies what these do not prevent: memory that no limit
counts, access to other processes, new namespaces, mounts, and rarely used parts of the kernel.
"""

from __future__ import annotations

import errno
import platform
import struct

from autograder.core.errors import KitError

_CALLS = {  # x86-64, the only architecture for which the ROS wheels exist
    "shmget": 29, "shmat": 30, "shmctl": 31, "shmdt": 67, "semget": 64, "semop": 65, "semctl": 66, "semtimedop": 220,
    "msgget": 68, "msgsnd": 69, "msgrcv": 70, "msgctl": 71, "mq_open": 240, "memfd_create": 319, "memfd_secret": 447,
    "ptrace": 101, "process_vm_readv": 310, "process_vm_writev": 311, "process_madvise": 440, "pidfd_getfd": 438,
    "kcmp": 312, "perf_event_open": 298, "bpf": 321, "userfaultfd": 323,
    "add_key": 248, "request_key": 249, "keyctl": 250,
    "io_uring_setup": 425, "io_uring_enter": 426, "io_uring_register": 427,
    "unshare": 272, "setns": 308, "chroot": 161, "pivot_root": 155, "mount": 165, "umount2": 166,
    "open_tree": 428, "move_mount": 429, "fsopen": 430, "fsconfig": 431, "fsmount": 432, "fspick": 433,
    "mount_setattr": 442, "open_by_handle_at": 304, "name_to_handle_at": 303, "quotactl": 179, "quotactl_fd": 443,
    "swapon": 167, "swapoff": 168, "reboot": 169, "sethostname": 170, "setdomainname": 171, "acct": 163,
    "init_module": 175, "finit_module": 313, "delete_module": 176, "kexec_load": 246, "kexec_file_load": 320,
    "settimeofday": 164, "clock_settime": 227, "adjtimex": 159, "clock_adjtime": 305, "syslog": 103,
    "iopl": 172, "ioperm": 173, "personality": 135, "uselib": 134, "lookup_dcookie": 212, "vhangup": 153,
    "fanotify_init": 300, "modify_ldt": 154, "mbind": 237, "set_mempolicy": 238,
    "migrate_pages": 256, "move_pages": 279, "vmsplice": 278, "tee": 276, "open_tree_attr": 467,
    # They tell which pages of a file of the system are in memory, and change that: notes for the next launch.
    "preadv2": 327, "fadvise64": 221, "readahead": 187, "mincore": 27,
    # Each rule of Landlock takes memory that no limit counts, and what io_setup takes is shared by the whole machine.
    "landlock_create_ruleset": 444, "landlock_add_rule": 445, "landlock_restrict_self": 446, "io_setup": 206,
}  # fmt: skip
_WITH_ARGUMENT = [  # (call, argument, value)
    # Calls on the first process: if a program slowed it down or limited it, a failure would look like our defect.
    (302, 0, 1), (203, 0, 1), (142, 0, 1), (144, 0, 1), (314, 0, 1),  # prlimit64, sched_setaffinity, …param, …attr
    (141, 1, 1), (141, 0, 2), (251, 1, 1), (251, 0, 3),  # setpriority, ioprio_set: on it, or on a user
    # fcntl's locks on parts of a file: each costs the kernel memory that no limit counts.
    (72, 1, 6), (72, 1, 7), (72, 1, 37), (72, 1, 38),
]  # fmt: skip
_CLONE, _FORK, _VFORK, _CLONE3, _SOCKET, _SOCKETPAIR = 56, 57, 58, 435, 41, 53
_NAMESPACE_FLAGS = 0x7E020000  # every CLONE_NEW* flag of clone
_THREAD_FLAG, _SHARED_FILES_FLAG = 0x10000, 0x400
_UNIX, _IPV4, _IPV6, _NETLINK = 1, 2, 10, 16
_DATAGRAM, _ROUTE = 2, 0
_SETSOCKOPT, _SOL_SOCKET, _BUFFER_SIZES = 54, 1, (7, 8, 32, 33)  # SO_SNDBUF, SO_RCVBUF, and their *FORCE variants
_SOL_IPV6, _FLOW_LABELS = 41, 32

_LOAD, _AND, _EQUAL, _SET, _AT_LEAST, _RETURN = 0x20, 0x54, 0x15, 0x45, 0x35, 0x06
_NUMBER, _ARGUMENTS = 0, 16
"""The offset of a call's number, and that of its arguments, which have eight bytes each, with the lower half first."""
_ALLOW, _ERRNO, _KILL = 0x7FFF0000, 0x00050000, 0x80000000
_ARCHITECTURE = 0xC000003E


def _step(code: int, value: int, yes: int = 0, no: int = 0) -> bytes:
    return struct.pack("HBBI", code, yes, no, value)


_REFUSE = _step(_RETURN, _ERRNO | errno.EPERM)


def filter_program() -> bytes:
    """Return the filter for everything in the node sandbox, as an array of `struct sock_filter`.

    Raises:
        KitError: this machine is not x86-64.
    """
    program = _beginning()
    for number in _CALLS.values():
        program += [_step(_EQUAL, number, 0, 1), _REFUSE]
    program += [_step(_EQUAL, _CLONE, 0, 4), _step(_LOAD, _ARGUMENTS), _step(_SET, _NAMESPACE_FLAGS, 0, 1), _REFUSE]
    program += [_step(_RETURN, _ALLOW)]
    for number, argument, value in _WITH_ARGUMENT:
        program += [_step(_EQUAL, number, 0, 4), _step(_LOAD, _ARGUMENTS + 8 * argument), _step(_EQUAL, value, 0, 1)]
        program += [_REFUSE, _step(_LOAD, _NUMBER)]
    # A flow label continues to exist after its socket and its launch, so a program could use it to count the launches.
    program += [_step(_EQUAL, _SETSOCKOPT, 0, 6), _step(_LOAD, _ARGUMENTS + 8), _step(_EQUAL, _SOL_IPV6, 0, 3)]
    program += [_step(_LOAD, _ARGUMENTS + 16), _step(_EQUAL, _FLOW_LABELS, 0, 1), _REFUSE, _step(_LOAD, _NUMBER)]
    # Calls that set the size of a socket's buffers have no effect, although they report success, because no limit
    # counts what is in these buffers.
    sizes = [_step(_EQUAL, option, len(_BUFFER_SIZES) - place, 0) for place, option in enumerate(_BUFFER_SIZES)]
    checks = [
        _step(_LOAD, _ARGUMENTS + 8),
        _step(_EQUAL, _SOL_SOCKET, 0, len(sizes) + 1),
        _step(_LOAD, _ARGUMENTS + 16),
    ]
    checks += [*sizes, _step(_RETURN, _ALLOW), _step(_RETURN, _ERRNO)]
    program += [_step(_EQUAL, _SETSOCKOPT, 0, len(checks)), *checks]
    for call in (_SOCKET, _SOCKETPAIR):
        checks = _socket_checks()
        program += [_step(_EQUAL, call, 0, len(checks)), *checks]
    program += [_step(_RETURN, _ALLOW)]
    return b"".join(program)


def _socket_checks() -> list[bytes]:
    """Return checks that allow Unix sockets, UDP, and netlink for listing the network interfaces.

    TCP is refused, because its buffers take megabytes that no limit counts.
    """
    return [
        _step(_LOAD, _ARGUMENTS),
        _step(_EQUAL, _UNIX, 10, 0), _step(_EQUAL, _IPV4, 3, 0), _step(_EQUAL, _IPV6, 2, 0),
        _step(_EQUAL, _NETLINK, 4, 0),
        _step(_RETURN, _ERRNO | errno.EAFNOSUPPORT),
        _step(_LOAD, _ARGUMENTS + 8), _step(_AND, 0xF), _step(_EQUAL, _DATAGRAM, 3, 2),
        _step(_LOAD, _ARGUMENTS + 16), _step(_EQUAL, _ROUTE, 1, 0),
        _step(_RETURN, _ERRNO | errno.EAFNOSUPPORT), _step(_RETURN, _ALLOW),
    ]  # fmt: skip


def no_processes() -> bytes:
    """Return an additional filter for one student's program, which may then start threads, but no processes.

    A node needs no other processes, and the hundreds of processes of a fork bomb take the CPUs from all other
    submissions for seconds before a limit ends them.

    Raises:
        KitError: this machine is not x86-64.
    """
    program = _beginning()
    for number in (_FORK, _VFORK):
        program += [_step(_EQUAL, number, 0, 1), _REFUSE]
    # A thread with its own table of open files would multiply the number of files that the limit allows.
    program += [_step(_EQUAL, _CLONE, 0, 4), _step(_LOAD, _ARGUMENTS)]
    program += [_step(_SET, _THREAD_FLAG, 0, 1), _step(_SET, _SHARED_FILES_FLAG, 1, 0), _REFUSE]
    return b"".join([*program, _step(_RETURN, _ALLOW)])


def _beginning() -> list[bytes]:
    """Return the beginning of every filter, which ends with loading the number of the call."""
    if platform.machine() != "x86_64":
        raise KitError(f"The sandbox's filter of system calls is written for x86_64, not {platform.machine()}.")
    return [
        _step(_LOAD, 4), _step(_EQUAL, _ARCHITECTURE, 1, 0), _step(_RETURN, _KILL),
        _step(_LOAD, _NUMBER), _step(_AT_LEAST, 0x40000000, 0, 1), _step(_RETURN, _KILL),  # the x32 calls
        _step(_EQUAL, _CLONE3, 0, 1), _step(_RETURN, _ERRNO | errno.ENOSYS),  # no filter sees its flags: use clone
    ]  # fmt: skip
