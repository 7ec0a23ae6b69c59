"""The work of the launcher, and of the first process of each launch.

The launcher creates these first processes, and ends everything when its socket is closed. A first process starts the
programs of its launch, and reports how they end.
"""

import contextlib
import os
import resource
import select
import shutil
import signal
import socket

from . import own_mounts
from .kernel import (
    CLONE_NEWNS,
    CLONE_NEWPID,
    PR_SET_CHILD_SUBREAPER,
    PR_SET_PDEATHSIG,
    checked,
    filter_calls,
    give_up_privileges,
    libc,
    limit,
    prctl,
)
from .requests import Launch, Start, answer, hand_over

_EXITING = 4
"""The kernel's flag for a process that is about to end (`PF_EXITING`)."""

_PARENT = os.getppid()
"""The process that started the launcher. The value is reliable because this module is loaded first, without delay."""


def serve_launches(channel: socket.socket, scratch: str) -> Launch:
    """Start the first process of each requested launch. This returns only in such a process."""
    signal.signal(signal.SIGCHLD, signal.SIG_IGN)  # the exit status of a first process is not needed
    while True:
        packet, passed, _, _ = socket.recv_fds(channel, 1 << 20, 1)
        if not packet:
            _end_everything(scratch)
        between = os.fork()
        if between == 0:
            channel.close()
            launch = Launch(packet, socket.socket(fileno=passed[0]))
            _fork_first_process(launch)
            return launch
        os.close(passed[0])
        with contextlib.suppress(ChildProcessError):
            os.waitpid(between, 0)


def _fork_first_process(launch: Launch) -> None:
    """Return only in the first process of a launch.

    This needs one more fork, because a process cannot change its own PID namespace.
    """
    try:
        if launch.namespaces:
            checked(libc.unshare(CLONE_NEWPID | CLONE_NEWNS))
        first = os.fork()
    except OSError as error:
        answer(launch.channel, {"broken": str(error)})
        os._exit(1)
    if first != 0:
        hand_over(launch.channel, {"first": True}, os.pidfd_open(first))
        os._exit(0)
    try:
        prctl(PR_SET_CHILD_SUBREAPER, 1, 0, 0, 0)
        if launch.namespaces:
            own_mounts.make(launch.disk, launch.inodes)
            own_mounts.close_settings()
            give_up_privileges()
        _, most = resource.getrlimit(resource.RLIMIT_NOFILE)
        if resource.RLIM_INFINITY != most < launch.limits["RLIMIT_NOFILE"]:  # correct programs could fail
            raise OSError(f"this machine allows a process only {most} open files")
        for name, value in launch.limits.items():
            limit(name, value)
        if launch.filter:
            filter_calls(launch.filter)
    except OSError as error:
        answer(launch.channel, {"broken": str(error)})
        os._exit(1)


def _end_everything(scratch: str) -> None:
    """End every program and then this process.

    If this is not the first process of a PID namespace, which ends with it, all descendants are found and killed here.
    """
    me = os.getpid()
    while me != 1:
        parents = _parents()
        family = {me}
        while grown := {pid for pid, parent in parents.items() if parent in family} - family:
            family |= grown
        if family == {me}:
            break
        for pid in family - {me}:
            with contextlib.suppress(ProcessLookupError, PermissionError):
                os.kill(pid, signal.SIGKILL)
    if scratch and not _parent_lives():  # a parent that is alive removes its folder itself
        shutil.rmtree(scratch, ignore_errors=True)
    os._exit(0)


def _parent_lives() -> bool:
    """Whether the process that started the launcher continues to run.

    The state of that process is checked, too, because when it ends, its socket is closed a moment before its children
    get another parent.
    """
    if os.getppid() != _PARENT:
        return False
    try:
        with open(f"/proc/{_PARENT}/stat") as stat:
            fields = stat.read().rpartition(")")[2].split()
    except OSError:
        return False
    return fields[0] not in "ZX" and not int(fields[6]) & _EXITING


def _parents() -> dict[int, int]:
    """Return every living process and its parent."""
    parents: dict[int, int] = {}
    for entry in os.listdir("/proc"):
        with contextlib.suppress(OSError, ValueError, IndexError):
            with open(f"/proc/{int(entry)}/stat") as stat:
                fields = stat.read().rpartition(")")[2].split()
            if fields[0] != "Z":
                parents[int(entry)] = int(fields[1])
    return parents


def serve_programs(launch: Launch) -> Start:
    """Serve requests as the first process of a launch until its end. This returns only in a program's process."""
    channel = launch.channel
    children: dict[int, int] = {}
    wake_read, wake_write = os.pipe2(os.O_NONBLOCK | os.O_CLOEXEC)
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the only signal from a program that would end this process
    signal.signal(signal.SIGCHLD, lambda *_: None)
    signal.set_wakeup_fd(wake_write, warn_on_full_buffer=False)
    poll = select.poll()
    poll.register(channel, select.POLLIN)
    poll.register(wake_read, select.POLLIN)
    answer(channel, {"ready": True})
    while True:
        for descriptor, _ in poll.poll():
            if descriptor == wake_read:
                with contextlib.suppress(BlockingIOError):
                    os.read(wake_read, 4096)
                continue
            packet, passed, _, _ = socket.recv_fds(channel, 1 << 20, 3)
            if not packet:
                _end(children)
            start = Start(packet, passed, launch)
            if _fork(channel, start, children) == 0:
                signal.set_wakeup_fd(-1)
                signal.signal(signal.SIGCHLD, signal.SIG_DFL)
                os.close(wake_read)
                os.close(wake_write)
                channel.close()
                return start
        _reap(channel, children)


def _end(children: dict[int, int]) -> None:
    for child in children:
        with contextlib.suppress(ProcessLookupError):
            os.kill(child, signal.SIGKILL)
    os._exit(0)


def _fork(channel: socket.socket, start: Start, children: dict[int, int]) -> int:
    """Fork and report the result on the channel. Return the result of `fork`, or -1 if it failed."""
    parent = os.getpid()
    try:
        child = os.fork()
    except OSError as error:
        answer(channel, {"failed": start.id, "why": str(error)})
        child = -1
    if child == 0:
        prctl(PR_SET_PDEATHSIG, signal.SIGKILL)
        if os.getppid() != parent:
            os._exit(1)
        return 0
    for descriptor in (start.output, start.events, start.stacks):
        os.close(descriptor)
    if child > 0:
        children[child] = start.id
        hand_over(channel, {"started": start.id}, os.pidfd_open(child))
    return child


def _reap(channel: socket.socket, children: dict[int, int]) -> None:
    while True:
        try:
            pid, status = os.waitpid(-1, os.WNOHANG)
        except ChildProcessError:
            return
        if pid == 0:
            return
        if pid in children:
            answer(channel, {"ended": children.pop(pid), "status": os.waitstatus_to_exitcode(status)})
