"""The work of the server of launchers, which loads everything once and then serves many submissions.

It runs in the grading sandbox, beside the fork server, and is told nothing of a submission except that it exists. There
are three kinds of processes. Each is a fork of the one before, and runs none of the student's code:

- the server;
- for each submission a *spare*, which is in the submission's namespaces, has no privileges, and waits;
- for each node sandbox a launcher, which is in the sandbox's own namespaces and works as `launcher.py` describes.

A spare and a launcher end together with the namespaces that they are in.
"""

import contextlib
import os
import signal
import socket
import sys

from .kernel import (
    CAP_SETPCAP,
    CAP_SYS_ADMIN,
    CLONE_NEWIPC,
    CLONE_NEWNET,
    CLONE_NEWNS,
    CLONE_NEWPID,
    CLONE_NEWUSER,
    CLONE_NEWUTS,
    PR_SET_CHILD_SUBREAPER,
    checked,
    give_up_privileges,
    libc,
    prctl,
)

_OF_A_SANDBOX = CLONE_NEWUSER | CLONE_NEWPID | CLONE_NEWIPC | CLONE_NEWUTS | CLONE_NEWNS
_OF_A_SUBMISSION = _OF_A_SANDBOX | CLONE_NEWNET


def serve_submissions(channel: socket.socket) -> socket.socket:
    """Fork a spare for each submission. This returns only in a launcher, with the socket of its launches.

    A request comes with a pidfd of the first process of a submission, and one end of a SOCK_SEQPACKET pair. On the
    other end, a request for a launcher comes with a pidfd of the first process of a node sandbox, the launcher's
    socket, and a file for its standard error.
    """
    signal.signal(signal.SIGCHLD, signal.SIG_IGN)  # the kernel forgets the forks when they have ended
    requests = _fork_into(channel, 2, _OF_A_SUBMISSION)
    give_up_privileges()
    launches = _fork_into(requests, 3, _OF_A_SANDBOX)
    # These two are what a launcher needs to give each launch its own process list and /tmp.
    give_up_privileges(CAP_SYS_ADMIN, CAP_SETPCAP)
    prctl(PR_SET_CHILD_SUBREAPER, 1, 0, 0, 0)
    return launches


def _fork_into(channel: socket.socket, descriptors: int, namespaces: int) -> socket.socket:
    """Fork for each request. This returns only in such a fork, in the namespaces of the process that the request names.

    Args:
        channel: where requests come from. When it is closed, this process ends.
        descriptors: the number of descriptors that come with a request.
        namespaces: the kinds of namespaces.
    """
    while True:
        packet, passed, _, _ = socket.recv_fds(channel, 16, descriptors)
        if not packet:
            os._exit(0)
        if len(passed) == descriptors and os.fork() == 0:
            channel.close()
            handle, ours, *errors = passed
            if errors:
                os.dup2(errors[0], 2)
                os.close(errors[0])
            _join(handle, namespaces)
            return socket.socket(fileno=ours)
        for descriptor in passed:
            os.close(descriptor)


def _join(handle: int, namespaces: int) -> None:
    """Return only in a new process in the namespaces of another process.

    This needs a fork, because a process cannot change its own PID namespace.
    """
    try:
        checked(libc.setns(handle, namespaces))
        os.close(handle)
        if os.fork() != 0:
            os._exit(0)
        os.setsid()
    except OSError as error:
        with contextlib.suppress(OSError):
            print(f"no launcher in a sandbox: {error}", file=sys.stderr, flush=True)
        os._exit(1)
