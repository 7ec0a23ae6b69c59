"""The first process of a launch: it starts the programs, and tells how they end."""

import contextlib
import os
import select
import signal
import socket

from .kernel import PR_SET_PDEATHSIG, prctl
from .requests import Launch, Start, answer, hand_over


def serve_programs(launch: Launch) -> Start:
    """Answer, as the first process of a launch, until its end. Returns only in a program's process."""
    channel = launch.channel
    children: dict[int, int] = {}
    wake_read, wake_write = os.pipe2(os.O_NONBLOCK | os.O_CLOEXEC)
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # of what a program may send it, the only one that would end it
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
    """Fork, and say what came of it; return what `fork` did, -1 if it failed."""
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
